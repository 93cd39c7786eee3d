"""Small scenes, checks and faults for scripted tests of how fluid and bodies act on each other.

    with tank(size=(0.6, 0.6, 0.8), depth=0.3, particle_spacing=0.05) as scene:
        scene.add_body("raft", box((0.3, 0.3, 0.2)), density=500.0, position=(0.3, 0.3, 0.3))
        scene.run(1.5)
        assert_draft(scene, "raft", 0.1, within=0.05)

Checks take a scene, a watched pybullet world (`watch`), a scenario run (`scenarios.bench`) or a recording. One that fails raises
`CheckFailed`, an AssertionError, with measured and expected value, tolerance and unit, and the particle spacing that would do. Claims about
the numerics run a scene several times. `FaultPlan`, as `scene.faults`, makes participants, lines and observers fail. The pytest plugin
`oilsim` (`scenarios.bench.plugin`) gives scenes as fixtures.
"""

from __future__ import annotations

from coupling.testkit.body_checks import (
    assert_added_mass,
    assert_damping,
    assert_draft,
    assert_force,
    assert_heel,
    assert_joint_gap,
    assert_metacentric_height,
    assert_period,
    assert_tension,
    assert_terminal_speed,
    assert_trim,
)
from coupling.testkit.claims import (
    assert_converges,
    assert_fmu_agrees,
    assert_matches_recording,
    assert_restarts_exactly,
    assert_same_at_half_step,
    assert_same_on_threads,
    fails_in_order,
    goes_on_in_order,
    viewer_fails_in_order,
)
from coupling.testkit.faults import Fault, FaultPlan, FaultyObserver, FaultyParticipant
from coupling.testkit.liquid_checks import (
    assert_dry,
    assert_energy_not_created,
    assert_momentum_conserved,
    assert_no_leak,
    assert_oil_contained,
    assert_pressure_hydrostatic,
    assert_reflection,
    assert_volume,
    assert_wave_height,
)
from coupling.testkit.readings import Basin, History, Readings, readings_of
from coupling.testkit.scene import Scene
from coupling.testkit.tanks import TankScene, empty_space, flume, pool, tank, wave_maker
from coupling.testkit.verdict import CheckFailed
from coupling.testkit.watched_world import WatchedWorld, watch

__all__ = [
    "Basin", "CheckFailed", "Fault", "FaultPlan", "FaultyObserver", "FaultyParticipant", "History", "Readings", "Scene", "TankScene",
    "WatchedWorld", "assert_added_mass", "assert_converges", "assert_damping", "assert_draft", "assert_dry", "assert_energy_not_created",
    "assert_fmu_agrees", "assert_force", "assert_heel", "assert_joint_gap", "assert_matches_recording", "assert_metacentric_height",
    "assert_momentum_conserved", "assert_no_leak", "assert_oil_contained", "assert_period", "assert_pressure_hydrostatic",
    "assert_reflection", "assert_restarts_exactly", "assert_same_at_half_step", "assert_same_on_threads", "assert_tension",
    "assert_terminal_speed", "assert_trim", "assert_volume", "assert_wave_height", "empty_space", "fails_in_order", "flume",
    "goes_on_in_order", "pool", "readings_of", "tank", "viewer_fails_in_order", "watch", "wave_maker",
]  # fmt: skip
