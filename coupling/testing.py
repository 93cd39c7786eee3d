"""Small scenes and checks for scripted tests of how fluid and bodies act on each other.

    with tank(size=(0.6, 0.6, 0.8), depth=0.3, particle_spacing=0.05) as scene:
        scene.add_body("raft", box((0.3, 0.3, 0.2)), density=500.0, position=(0.3, 0.3, 0.3))
        scene.run(1.5)
        assert_draft(scene, "raft", 0.1, within=0.05)

A check that fails raises AssertionError with what was found and what was expected. `FaultyParticipant` makes any participant
fail at a chosen step, to test what a master or an exercise does then.
"""

from __future__ import annotations

from coupling.testkit.faults import Fault, FaultyParticipant
from coupling.testkit.scene import Scene, TankScene, empty_space, tank
from coupling.testkit.scene_checks import assert_draft, assert_momentum_conserved, assert_pressure_hydrostatic

__all__ = [
    "Fault", "FaultyParticipant", "Scene", "TankScene", "assert_draft", "assert_momentum_conserved",
    "assert_pressure_hydrostatic", "empty_space", "tank",
]  # fmt: skip
