"""No direction is special: a scene that is turned or mirrored has turned or mirrored forces, velocities and impulses.

Turning sends x to y, y to z and z to x; mirroring reverses x. Kernels write each axis on its own, so that an error in one of them shows.
Only the order of sums differs, so results agree within single precision.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from oilsim import Phase, block, solid_box, tank_walls
from oilsim.stages.explicit import apply_adhesion, apply_tension
from tests.oilsim.conftest import disturbed, prepare

SPACING, HALF = 0.1, 1.0
OIL = Phase(name="oil", rest_density=850.0, dynamic_viscosity=2.0, interfacial_tension=0.05, adhesion=0.07)
WATER = Phase(name="water", rest_density=1000.0, dynamic_viscosity=1.0)
TURNED = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
MIRRORED = np.diag([-1.0, 1.0, 1.0])
BODY = np.array([0.5, 0.3, 0.4])  # [m], edges of the box
INVERSE_MASS = np.diag([0.05, 0.05, 0.05, 0.9, 0.6, 0.7])  # [1/kg, 1/(kg m2)]


def scene(make_fluid, move):
    """Oil and water in a corner of three walls with a moving box in them, in directions changed by `move` (3, 3)."""
    box = {"lower": (-HALF,) * 3, "upper": (HALF,) * 3, "gravity": tuple(move @ [-2.0, -3.0, -8.0])}
    fluid = make_fluid(phases=(OIL, WATER), **box)
    sides = tuple(("-" if (move @ -np.eye(3)[axis]).sum() < 0.0 else "+") + name for axis, name in sides_of(move))
    walls = replace(tank_walls((-HALF,) * 3, (HALF,) * 3, SPACING, sides=sides), contact_angle=60.0)
    fluid.add_boundary(walls)
    points = disturbed(block((-HALF,) * 3, (0.2, 0.2, 0.2), SPACING), 0.06 * SPACING, 5)
    turn = Rotation.from_euler("xyz", [0.3, -0.5, 0.7]).as_matrix()
    place = np.array([-0.35, -0.3, -0.4])
    points = points[(np.abs((points - place) @ turn) > 0.5 * BODY + 0.4 * SPACING).any(axis=1)]
    oily = points @ [0.4, 0.7, 1.0] > -0.5
    for chosen, name in ((oily, "oil"), (~oily, "water")):
        speed = np.stack([points[chosen, 1], points[chosen, 2], 0.5 * points[chosen, 0]], axis=1)
        fluid.add_particles(points[chosen] @ move.T, phase=name, velocity=speed @ move.T)
    edges = np.abs(move) @ BODY
    body = fluid.add_boundary(replace(solid_box(tuple(edges), SPACING), contact_angle=35.0))
    both = np.kron(np.eye(2), move)
    both[3:] *= np.linalg.det(move)  # angular velocities are axial vectors
    pose = Rotation.from_matrix(move @ turn @ move.T).as_quat()
    twist = both @ [0.2, -0.1, 0.3, 0.4, 0.5, -0.3]
    mass = both @ INVERSE_MASS @ both.T
    fluid.set_boundary_motion(body, move @ place, pose, twist[:3], twist[3:], mass)
    return fluid, body, both


def sides_of(move):
    """Return, for each axis, the axis that it is moved to, with its name."""
    return [(axis, "xyz"[int(np.abs(move[:, axis]).argmax())]) for axis in range(3)]


def stage(fluid, name):
    """Set the velocities (3, N) [m/s] to what one stage alone gives still liquid in a second."""
    prepare(fluid)
    fluid.state.velocity[:] = 0.0
    neighbors, state = fluid.arrays.neighbors, fluid.state
    if name == "tension":
        force = apply_tension(fluid.context, neighbors, state.phase, state.velocity, 1.0)
    else:
        force = apply_adhesion(fluid.context, neighbors, state.position, state.phase, state.velocity, 1.0)
    fluid.context.walls.receive(force)


def step(fluid):
    fluid.advance(0.004)


# each with the difference that rounding makes; the solves of a step stop at a tolerance
STAGES = {
    "tension": (lambda fluid: stage(fluid, "tension"), 2e-5),
    "adhesion": (lambda fluid: stage(fluid, "adhesion"), 2e-5),
    "step": (step, 5e-4),
}


def outcome(make_fluid, move, name):
    """Return velocities (N, 3) [m/s] by particle id, and the impulse on the body (6,) [N s, N m s], in the directions before the move."""
    fluid, body, both = scene(make_fluid, move)
    STAGES[name][0](fluid)
    velocity = fluid.state.velocity.T[np.argsort(fluid.state.id)].astype(np.float64) @ move
    return velocity, both.T @ np.asarray(fluid.context.walls.moving[body].impulse, np.float64)


@pytest.mark.parametrize("move", [TURNED, TURNED @ TURNED, MIRRORED], ids=["turned", "turned twice", "mirrored"])
@pytest.mark.parametrize("name", list(STAGES))
def test_directions_are_alike(make_fluid, name, move):
    velocity, impulse = outcome(make_fluid, np.eye(3), name)
    moved_velocity, moved_impulse = outcome(make_fluid, move, name)
    tolerance = STAGES[name][1]
    assert np.abs(impulse).min() > tolerance * np.abs(impulse).max()  # the scene has something in every direction
    assert moved_velocity == pytest.approx(velocity, abs=tolerance * np.abs(velocity).max())
    assert moved_impulse == pytest.approx(impulse, abs=tolerance * np.abs(impulse).max())
