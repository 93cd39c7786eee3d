"""Moving no-slip bodies inside the viscous solve: one symmetric system, whose solution bodies and liquid share."""

from __future__ import annotations

import numpy as np
import pytest

from oilsim import Phase, block, solid_box
from oilsim.stages.viscosity import viscous_system
from oilsim.viscosity.viscous_response import ViscousResponse
from tests.oilsim.conftest import disturbed, let_viscosity_act, prepare

SPACING, MASS, STEP = 0.1, 0.5, 0.02  # m; kg of each box, of 27 kg of liquid displaced; s
INVERSE_MASS = np.diag([1 / MASS] * 3 + [1 / (MASS * 0.015)] * 3)
TIED = np.block(
    [[0.5 * INVERSE_MASS, 0.4 * INVERSE_MASS], [0.4 * INVERSE_MASS, 0.5 * INVERSE_MASS]]
)  # as a stiff joint does
PLACES = ((-0.3, 0.0, 0.0), (0.3, 0.0, 0.0))


@pytest.fixture
def stirred(make_fluid):
    """Function (viscosity [Pa s], tied) -> two light boxes in liquid that moves at random about 1 m/s; their handles."""

    def build(viscosity, tied=False, boxes=PLACES):
        phases = (
            Phase(name="thick", rest_density=1000.0, dynamic_viscosity=viscosity),
            Phase(name="thin", rest_density=1000.0),
        )
        fluid = make_fluid(
            particle_spacing=SPACING,
            phases=phases,
            lower=(-2, -2, -2),
            upper=(2, 2, 2),
            gravity=(0, 0, 0),
            viscosity_tolerance=1e-6,
        )
        points = disturbed(block((-0.8, -0.6, -0.5), (0.8, 0.6, 0.5), SPACING), 0.05 * SPACING, 0)
        for place in boxes:
            points = points[(np.abs(points - place) > 0.15).any(axis=1)]
        random = np.random.default_rng(1)
        fluid.add_particles(points, phase="thick", velocity=random.normal((1.0, 0.0, 0.0), 0.3, points.shape))
        handles = [fluid.add_boundary(solid_box((0.3, 0.3, 0.3), SPACING, no_slip=True)) for _ in boxes]
        for handle, place in zip(handles, boxes, strict=True):
            fluid.set_boundary_motion(handle, place, (0, 0, 0, 1), (0, 0, 0), (0, 0, 0), INVERSE_MASS)
        if tied:
            fluid.set_joint_inverse_mass(handles, TIED)
        prepare(fluid)
        return fluid, handles

    return build


def response_of(fluid, theta=1.0):
    """The bodies' part of a step, with the system it belongs to."""
    context, arrays = fluid.context, fluid.arrays
    viscosity, phase = context.constants.pair_viscosity, fluid.state.phase
    system = viscous_system(context, arrays.neighbors, arrays.pairs, phase, arrays.sums.surface, viscosity)
    gradients = arrays.pairs.wall_gradient, system.stiffness.walls
    return system, ViscousResponse(
        context.walls, arrays.neighbors.body_pairs, *gradients, context.constants.volume, STEP, theta
    )


@pytest.mark.parametrize("tied", [False, True])
def test_the_system_is_symmetric_and_positive(stirred, tied):
    fluid, _ = stirred(100.0, tied)
    system, bodies = response_of(fluid)
    random = np.random.default_rng(2)
    a, b = random.normal(size=(2, 3, fluid.particle_count)).astype(np.float32)

    def image(direction):
        return system.force(direction, bodies.response_to(direction)).astype(np.float64)

    assert (a * image(b)).sum() == pytest.approx((b * image(a)).sum(), rel=1e-4)
    assert (a * image(a)).sum() < 0.0  # dissipates
    unmoved = system.force(a, None).astype(np.float64)
    assert (a * unmoved).sum() < (a * image(a)).sum()  # bodies that give way are dragged less than walls that do not


@pytest.mark.parametrize("viscosity", [0.01, 1.0, 1e3])
@pytest.mark.parametrize("tied", [False, True])
def test_a_step_keeps_momentum_and_throws_no_light_body(stirred, viscosity, tied):
    fluid, handles = stirred(viscosity, tied)
    before, fastest = fluid.momentum(), float(np.abs(fluid.state.velocity).max())
    let_viscosity_act(fluid, STEP)
    bodies = [fluid.context.walls.moving[handle] for handle in handles]
    given = np.sum([body.impulse[:3] for body in bodies], axis=0)
    assert fluid.momentum() + given == pytest.approx(before, abs=1e-6 * np.linalg.norm(before))
    answers = (TIED if tied else np.kron(np.eye(2), INVERSE_MASS)) @ np.concatenate([body.impulse for body in bodies])
    assert np.concatenate([body.twist for body in bodies]) == pytest.approx(answers, rel=1e-9)
    for body in bodies:
        assert np.linalg.norm(body.twist[:3]) < fastest
    if viscosity >= 1e3:
        assert bodies[0].twist[0] == pytest.approx(1.0, abs=0.1)  # goes with the liquid


def test_liquid_without_viscosity_drags_nothing(stirred):
    fluid, handles = stirred(1.0, boxes=PLACES[:1])
    far = fluid.state.position[0] > 0.5
    fluid.state.phase[~far] = fluid.config.phase_index("thin")
    prepare(fluid)
    let_viscosity_act(fluid, STEP)
    assert not fluid.context.walls.moving[handles[0]].impulse.any()
