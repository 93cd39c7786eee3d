"""Lanes: what the compiler makes of every operation equals what numpy does, over ranges of every length."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest
from numba import njit
from numba.core.errors import TypingError

from oilsim import block
from oilsim.backend.simd import (
    LANES,
    above_zero,
    below,
    floor,
    gather,
    gather_four,
    load,
    only,
    positive,
    root,
    spread,
    store,
    summed,
)
from tests.oilsim.conftest import disturbed, prepare

ONE = np.float32(1.0)


def uncompiled(function):
    return getattr(function, "py_func", function)


@njit(fastmath=True)
def everything(first, last, neighbor, left, right, result):
    sums = others = spread(np.float32(0.0))
    for k in range(first, last, LANES):
        present = below(last, k)
        other = gather(right, load(neighbor, k, present))
        value = load(left, k, present)
        value = (root(value) - floor(np.float32(9.0) * other)) * other / (ONE + value) + positive(other - value)
        value = only(above_zero(value - other), value, np.float32(-1.0))
        sums += only(present, value, np.float32(0.0))
        others += only(present, other, ONE)
        store(result, k, present, -value)
    return summed(sums) - summed(others)


@pytest.mark.parametrize("length", [0, 1, LANES - 1, LANES, LANES + 1, 3 * LANES + 5])
@pytest.mark.parametrize("first", [0, 3])
def test_compiled_lanes_equal_numpy(first, length):
    rng = np.random.default_rng(length)
    neighbor = rng.integers(0, 40, 80).astype(np.uint32)
    left, right = rng.random(80).astype(np.float32), rng.random(40).astype(np.float32)
    compiled = np.full(80, 7.0, np.float32)
    plain = compiled.copy()
    sums = everything(first, first + length, neighbor, left, right, compiled)
    expected = uncompiled(everything)(first, first + length, neighbor, left, right, plain)
    assert sums == pytest.approx(expected, rel=1e-5, abs=1e-5)
    assert compiled == pytest.approx(plain, rel=1e-5, abs=1e-6)
    assert (compiled[:first] == 7.0).all()
    assert (compiled[first + length :] == 7.0).all()


@njit(fastmath=True)
def four_of_each(neighbor, values, column, result):
    count = result.shape[1]
    for k in range(0, count, LANES):
        present = below(count, k)
        for n, lanes in enumerate(gather_four(values, load(neighbor, k, present), column)):
            store(result[n], k, present, lanes)


@pytest.mark.parametrize(("columns", "column"), [(4, 0), (8, 4), (16, 8)])
def test_four_numbers_of_each_lane_come_in_their_order(columns, column):
    rng = np.random.default_rng(columns)
    count, values = 3 * LANES + 5, rng.random((30, columns), np.float32)
    neighbor = np.zeros(4 * LANES, np.uint32)  # absent lanes read an index too
    neighbor[:count] = rng.integers(0, 30, count)
    result = np.zeros((4, count), np.float32)
    four_of_each(neighbor, values, column, result)
    assert np.array_equal(result, values[neighbor[:count], column : column + 4].T)


def test_scalars_of_the_same_functions_keep_their_precision():
    @njit
    def of_scalars(x):
        return root(x), floor(x), positive(x), positive(-x)

    for value in (np.float32(2.25), 1e300):
        assert of_scalars(value) == (np.sqrt(value), np.floor(value), value, 0.0)


@pytest.mark.skipif(not hasattr(everything, "py_func"), reason="the compiler is switched off")
def test_a_double_is_refused():
    @njit
    def doubled(x):
        return summed(spread(x) * 2.0)

    with pytest.raises(TypingError):
        doubled(ONE)


@pytest.mark.parametrize(
    "settings", [{"NUMBA_CPU_NAME": "haswell", "NUMBA_CPU_FEATURES": ""}, {"NUMBA_DISABLE_JIT": "1"}]
)
def test_other_processors_and_plain_python(settings, tmp_path):
    if any(os.environ.get(name) == value for name, value in settings.items()):
        return
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", __file__, "-k", "equal_numpy or scalars"]
    environment = os.environ | settings | {"NUMBA_CACHE_DIR": str(tmp_path)}
    run = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout


@pytest.mark.parametrize(("dimension", "periodic"), [(2, True), (3, True), (3, False)])
def test_vectors_of_a_pair_are_exactly_opposite(make_fluid, dimension, periodic):
    fluid = make_fluid(
        dimension=dimension, periodic=(periodic, periodic and dimension == 3, periodic), upper=(1.0, 1.0, 1.0)
    )
    points = disturbed(block((0, 0, 0), (1, 1, 1), 0.1, dimension), 0.01, 3) % 1.0
    if dimension == 2:
        points[:, 1] = 0.0
    fluid.add_particles(points, phase="water")
    fluid.state.velocity[:] = np.random.default_rng(4).normal(size=fluid.state.velocity.shape)
    prepare(fluid, 1e-3)
    pairs, count = fluid.arrays.neighbors.neighborhood.fluid, fluid.particle_count
    vectors = np.zeros((count, count, 3), np.int16)
    for i in range(count):
        listed = slice(pairs.start[i], pairs.start[i] + pairs.number[i])
        vectors[i, pairs.neighbor[listed]] = fluid.arrays.pairs.gradient.whole[:, listed].T
    assert np.count_nonzero(vectors) > 20 * count
    assert np.array_equal(vectors, -vectors.transpose(1, 0, 2))
