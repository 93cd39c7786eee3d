"""Readers outside see the solver's own arrays, and cannot change them; what changes a fluid is said to it."""

from __future__ import annotations

import ast
from pathlib import Path

import numpy as np
import pytest

from oilsim import Fluid, FluidConfig, Phase, block, solid_box, tank_walls

SPACING = 0.1
INSIDE = ("arrays", "clock", "context", "state")  # of `Fluid`, public to the rooms of oilsim only
MEASURES_THE_STEP_ITSELF = ("tests/benchmarks/budget.py",)  # whose stages it replaces


def column() -> Fluid:
    """A cube of water of 4 by 4 by 4 particles in a tank."""
    water = Phase(name="water", rest_density=1000.0)
    config = FluidConfig(particle_spacing=SPACING, phases=(water,), lower=(-0.4, -0.4, -0.4), upper=(0.8, 0.8, 1.2))
    fluid = Fluid(config, threads=1)
    fluid.add_boundary(tank_walls((0.0, 0.0, 0.0), (0.4, 0.4, 0.8), SPACING, sides=("-x", "+x", "-y", "+y", "-z")))
    fluid.add_particles(block((0.0, 0.0, 0.0), (0.4, 0.4, 0.4), SPACING), phase="water")
    return fluid


def test_particles_are_seen_and_not_written_to() -> None:
    fluid = column()
    seen = fluid.particles
    assert seen.position.shape == (3, 64) and seen.asleep == 0
    for values in seen[:5]:
        with pytest.raises(ValueError, match="read-only"):
            values[..., 0] = 0
    fluid.advance(0.01)  # the solver's own arrays can be written to as before
    assert np.array_equal(np.sort(fluid.particles.id), np.arange(64))


def test_velocities_are_given_in_the_order_of_the_particles() -> None:
    fluid = column()
    fluid.advance(0.01)  # sorts them
    wanted = 0.1 * fluid.particles.position.astype(np.float64)
    fluid.set_velocities(wanted)
    np.testing.assert_allclose(fluid.phase_velocities("water"), 0.1 * fluid.phase_positions("water"), rtol=1e-6)
    with pytest.raises(ValueError, match=r"velocity has shape \(64, 3\), allowed: \(3, 64\)"):
        fluid.set_velocities(wanted.T)
    with pytest.raises(ValueError, match=r"velocity has nan at \(0, 0\), allowed: finite numbers"):
        fluid.set_velocities(np.full((3, 64), np.nan))


def test_particles_are_taken_out_by_marks() -> None:
    fluid = column()
    fluid.remove_particles(fluid.particles.position[2] > 0.2)
    assert fluid.particle_count == 32 and fluid.phase_positions("water")[:, 2].max() < 0.2
    fluid.advance(0.01)
    with pytest.raises(ValueError, match=r"chosen is int64 \(32,\), allowed: bool \(32,\)"):
        fluid.remove_particles(np.arange(32))
    fluid.remove_particles(np.ones(32, bool))
    assert fluid.particle_count == 0
    fluid.advance(0.01)


def test_boundaries_are_seen_by_their_handles() -> None:
    fluid = column()
    handle = fluid.add_boundary(solid_box((0.2, 0.2, 0.2), SPACING))
    assert len(fluid.boundaries) == 2 and fluid.moving_boundaries == ()
    assert len(fluid.boundaries[handle].volume) == 8
    with pytest.raises(ValueError, match=f"boundary {handle} does not move, allowed: "):
        fluid.boundary_motion(handle)
    fluid.set_boundary_motion(handle, (0.2, 0.2, 0.7), (0, 0, 0, 1), (0.0, 0.0, 0.5), (0.0, 0.0, 0.0))
    fluid.advance(0.1)
    motion = fluid.boundary_motion(handle)
    np.testing.assert_allclose(motion.position, (0.2, 0.2, 0.75), atol=1e-12)
    motion.position[:] = 0.0  # a copy
    assert fluid.moving_boundaries == (handle,) and fluid.boundary_motion(handle).position[2] > 0.7


def test_a_load_is_that_of_the_last_advance_until_the_next() -> None:
    fluid = column()
    handle = fluid.add_boundary(solid_box((0.2, 0.2, 0.2), SPACING))
    motion = handle, (0.2, 0.2, 0.3), (0, 0, 0, 1), (0.0, 0.0, -0.5), (0.0, 0.0, 0.0)
    fluid.set_boundary_motion(*motion)
    fluid.advance(0.01)
    load = fluid.boundary_wrench(handle)
    fluid.set_boundary_motion(*motion)
    np.testing.assert_array_equal(fluid.boundary_wrench(handle), load)
    assert load.any()


def test_a_body_falls_where_there_is_no_liquid() -> None:
    fluid = column()
    fluid.remove_particles(np.ones(fluid.particle_count, bool))
    handle = fluid.add_boundary(solid_box((0.2, 0.2, 0.2), SPACING))
    fluid.set_boundary_motion(
        handle, (0.2, 0.2, 0.7), (0, 0, 0, 1), np.zeros(3), np.zeros(3), np.eye(6), (0, 0, -9.81, 0, 0, 0)
    )
    fluid.advance(0.01)
    np.testing.assert_allclose(fluid.boundary_twist(handle), (0, 0, -0.0981, 0, 0, 0))


def inside_of_a_fluid(source: str) -> list[str]:
    """Places in Python source where a fluid's own parts, or a private attribute of it, are reached for."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Attribute) and (node.attr in INSIDE or node.attr.startswith("_")):
            owner = getattr(node.value, "attr", getattr(node.value, "id", ""))
            if owner in ("fluid", "_fluid"):
                found.append(f"{owner}.{node.attr}, line {node.lineno}")
    return found


def test_readers_outside_reach_for_nothing_inside() -> None:
    assert inside_of_a_fluid("x = world.fluid.context.team") == ["fluid.context, line 1"]
    root, found = Path(__file__).parents[3], {}
    for room in ("coupling", "booms", "vessels", "scenarios", "recordings", "tests", "docs"):
        for path in sorted((root / room).rglob("*.py")):
            name = path.relative_to(root).as_posix()
            if not name.startswith("tests/oilsim/") and name not in MEASURES_THE_STEP_ITSELF:
                found[name] = inside_of_a_fluid(path.read_text(encoding="utf-8"))
    assert len(found) > 300
    assert {name: places for name, places in found.items() if places} == {}
