"""The matrices of the pressure's pair vectors: inverse moments inside a liquid, the lattice's where neighbours hardly span space."""

from __future__ import annotations

import math

import numpy as np
import pytest

from oilsim import Phase, block
from oilsim.gradients.gradient_correction import EXACT, FULL, THIN, exact_share
from oilsim.neighborhood.smoothing_kernels import SUPPORT, lattice_moment, normalisation
from tests.oilsim.conftest import disturbed
from tests.oilsim.gradients.test_particle_sums import SPACING, fields


def moments(fluid):
    """M_i (N, dim, dim) of a fluid without walls, by sums over all pairs in double precision."""
    dimension = fluid.config.dimension
    axes = [0, 2] if dimension == 2 else [0, 1, 2]
    x = fluid.state.position[axes].astype(np.float64).T
    apart = x[:, None] - x[None]
    q = np.linalg.norm(apart, axis=2) / (SUPPORT * SPACING)
    # -(dW/dq) / q / H^2 of Wendland's C2 function, V = d^dim
    slope = 20.0 * normalisation(SPACING, dimension) * np.maximum(1.0 - q, 0.0) ** 3
    slope *= SPACING**dimension / (SUPPORT * SPACING) ** 2
    return np.einsum("ij,ija,ijb->iab", slope, apart, apart)


@pytest.mark.parametrize("dimension", [2, 3])
def test_face_matrices_are_inverse_moments_where_neighbours_span_space(make_fluid, dimension):
    fluid = make_fluid(dimension=dimension)
    points = disturbed(block((0.5,) * 3, (1.9 if dimension == 2 else 1.4,) * 3, SPACING, dimension), 0.1 * SPACING, 0)
    lone = np.array([[0.1, 0.1, 0.1], [0.25, 0.1, 0.1]])  # span a line, if anything
    points = np.concatenate([points, lone]) * ((1, 0, 1) if dimension == 2 else (1, 1, 1))
    fluid.add_particles(points, phase="water")
    _, _, _, found = fields(fluid)
    expected = moments(fluid)
    smallest = np.linalg.eigvalsh(expected)[:, 0]
    entries = [0, 2, 5] if dimension == 2 else [0, 1, 2, 3, 4, 5]
    upper = np.triu_indices(dimension)
    plain = (np.eye(dimension) / lattice_moment(dimension))[upper]
    core, thin = smallest > FULL, smallest < THIN
    assert core.sum() > 15 and thin.sum() >= 2
    inverse = np.linalg.inv(expected[core])[:, upper[0], upper[1]]
    assert np.abs(found[core][:, entries] - (float(EXACT) * inverse + (1.0 - float(EXACT)) * plain)).max() < 1e-5
    assert np.abs(found[thin][:, entries] - plain).max() < 1e-6
    # between the two matrices elsewhere: sizes within theirs
    largest = np.maximum(1.0 / np.maximum(smallest, float(THIN)), 1.0 / lattice_moment(dimension))
    assert (np.abs(found[:, entries]).max(axis=1) <= largest + 1e-5).all()


def test_the_elastic_share_falls_where_viscosity_outruns_the_filter(make_fluid):
    assert exact_share(0.0) == exact_share(1.0) == float(EXACT)
    assert 1.0 - exact_share(10.0) == pytest.approx(0.1 * (1.0 - float(EXACT)))
    phases = tuple(Phase(name=f"oil {mu:g}", rest_density=1000.0, dynamic_viscosity=mu) for mu in (1e-3, 300.0))
    thin, thick = make_fluid(phases=phases, gravity=(0.0, 0.0, -10.0)).context.constants.exact
    # 10 nu / d^2 of the finest motion over 1 / (1.5 sqrt(d / g)) of the filter
    damping = 10.0 * 0.3 / SPACING**2 * 1.5 * math.sqrt(SPACING / 10.0)
    assert damping > 2.0
    assert (thin, thick) == pytest.approx((float(EXACT), 1.0 - (1.0 - float(EXACT)) / damping), rel=1e-6)
    assert (make_fluid(phases=phases, gravity=(0.0, 0.0, 0.0)).context.constants.exact == EXACT).all()
