"""What the README and the trainer's guide show runs as it stands."""

from __future__ import annotations

import re
import warnings
from pathlib import Path

import numpy as np
import pybullet
import pybullet_data

from coupling.participants.fluid import FluidParticipant
from scenarios.running.assembly import build
from scenarios.spec.load import load_scenario
from tests.docs.guide import DOCS, write_files

README = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")


def code_block(language: str) -> str:
    """The README's only block of that language."""
    (found,) = re.findall(rf"```{language}\n(.*?)```", README, flags=re.DOTALL)
    return found


def test_plugin_example_runs():
    client = pybullet.connect(pybullet.DIRECT)
    pybullet.setAdditionalSearchPath(pybullet_data.getDataPath(), physicsClientId=client)
    pybullet.setGravity(0, 0, -9.81, physicsClientId=client)
    floor = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=[0.8, 0.8, 0.1], physicsClientId=client)
    ground = pybullet.createMultiBody(0, floor, basePosition=[0, 0, -0.05], physicsClientId=client)
    duck = pybullet.loadURDF("cube.urdf", [0, 0, 0.9], globalScaling=0.4, physicsClientId=client)
    names = {"client": client, "ground": ground, "duck": duck}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        exec(code_block("python"), names)
    fluid = names["fluid"]
    assert fluid.time > 20 / 250
    assert np.isfinite(fluid.phase_positions("water")).all()
    pybullet.disconnect(client)


def test_crate_of_the_trainers_guide_is_sound_and_floats(tmp_path):
    guide = DOCS / "guides" / "trainer.md"
    write_files(guide, tmp_path)
    assembly = build(load_scenario(tmp_path / "crate.toml", overrides=["fluid.particle_spacing=0.09"]).scenario)
    run = assembly.co_simulation()
    run.initialize()
    for _ in range(30):
        run.step()
    assert isinstance(assembly.fluid_participant, FluidParticipant)
    # it lies in the water where it displaces its weight; whichever way it moves, the water carries about that
    weight = 500.0 * 0.36**3 * 9.81
    assert 0.3 * weight < assembly.fluid_participant.get("crate.wrench")[2] < 3.0 * weight
    run.terminate("test is over")
