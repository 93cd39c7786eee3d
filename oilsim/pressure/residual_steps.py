"""The kernels of `bounded_solver`: the free set, a step of conjugate residuals on it (Saad 2003, 6.8), and the residual with the bounds."""

from __future__ import annotations

from typing import NamedTuple

from numba import njit

from oilsim.backend.arrays import Real
from oilsim.backend.jit import FAST, ONE, ZERO
from oilsim.backend.simd import LANES, above_zero, below, load, only, positive, spread, store, summed
from oilsim.backend.thread_team import BLOCK


class Pressures(NamedTuple):
    """The unknowns of a solve.

    kappa (N,)        pressure times time over rho_ref [m2/s]
    gradient (N,)     g = A kappa - b [1/s], which moves with kappa
    diagonal (N,)     that of A [1/m2]
    """

    kappa: Real
    gradient: Real
    diagonal: Real


class SearchDirection(NamedTuple):
    """The direction of a step of conjugate residuals.

    direction (N,)         p [m2/s]
    image (N,)             A p [1/s]
    preconditioned (N,)    M^-1 A p [m2/s], M^-1 the preconditioner in the free set
    """

    direction: Real
    image: Real
    preconditioned: Real


@njit(**FAST)
def choose_free_set(begin, end, pressures, mobility, closed, opening, free, scaled, sums):
    """Choose the free set, and add up the residual with what clamping negative pressures would add to it.

    pressures            `Pressures`
    mobility (N,)        1 / diag A [m2]
    closed               whether the liquid fills a box, so that its pressure has no bound
    opening              whether particles that would be pressed after a Jacobi step join the free set
    free (N,)            becomes 1 in the free set, 0 elsewhere [1]
    scaled (N,)          becomes g / diag A in the free set, 0 elsewhere [m2/s]
    sums (blocks, 3)     the first column becomes block sums of the residual [1/s]
    """
    kappa, gradient, _ = pressures
    for block in range(begin, end, BLOCK):
        last, residual = min(block + BLOCK, end), spread(ZERO)
        for k in range(block, last, LANES):
            present = below(last, k)
            pressure, excess = load(kappa, k, present), load(gradient, k, present)
            on = spread(ONE) if closed else only(above_zero(pressure), spread(ONE), ZERO)
            ease = load(mobility, k, present)
            residual += positive(-excess) + on * positive(excess)
            if not closed:
                residual += only(present, positive(-pressure) / ease, ZERO)
            if opening:
                on = only(above_zero(-excess), spread(ONE), on)
            store(free, k, present, on)
            store(scaled, k, present, on * excess * ease)
        sums[block // BLOCK, 0] = summed(residual)


@njit(**FAST)
def advance(begin, end, pressures, scaled, search, closed, free, step, sums):
    """Take a step: kappa -= step p, g -= step A p, scaled -= step M^-1 A p, and sum the residual.

    pressures            `Pressures`; kappa and gradient move
    scaled (N,)          M^-1 g in the free set [m2/s], moves
    search               `SearchDirection`
    closed               whether the liquid fills a box, so that its pressure has no bound
    free (N,)            1 in the free set, 0 elsewhere [1]
    step                 length of the step [1]
    sums (blocks, 3)     become block sums of the residual in the free set and outside, and of what clamping would add [1/s]
    """
    kappa, gradient, diagonal = pressures
    direction, image, preconditioned = search
    for block in range(begin, end, BLOCK):
        last = min(block + BLOCK, end)
        on_free = off_free = harm = spread(ZERO)
        for k in range(block, last, LANES):
            present = below(last, k)
            pressure = load(kappa, k, present) - step * load(direction, k, present)
            excess = load(gradient, k, present) - step * load(image, k, present)
            on = load(free, k, present)
            store(kappa, k, present, pressure)
            store(gradient, k, present, excess)
            store(scaled, k, present, load(scaled, k, present) - step * load(preconditioned, k, present))
            on_free += on * (positive(excess) + positive(-excess))
            off_free += (ONE - on) * positive(-excess)
            harm += on * load(diagonal, k, present) * positive(-pressure)
        sums[block // BLOCK, 0], sums[block // BLOCK, 1] = summed(on_free), summed(off_free)
        sums[block // BLOCK, 2] = ZERO if closed else summed(harm)


@njit(**FAST)
def next_direction(begin, end, scaled, product, beta, mobility, free, search):
    """Make the next direction, p = scaled + beta p, with its image, and the diagonal's part of the preconditioner.

    scaled (N,): M^-1 g [m2/s]; product (N,): A scaled [1/s]; beta [1]; mobility (N,): 1 / diag A [m2]; free (N,): 1 in the free set, 0
    elsewhere; search: `SearchDirection`, which becomes the next one.
    """
    direction, image, preconditioned = search
    for k in range(begin, end, LANES):
        present = below(end, k)
        store(direction, k, present, load(scaled, k, present) + beta * load(direction, k, present))
        follows = load(product, k, present) + beta * load(image, k, present)
        store(image, k, present, follows)
        store(preconditioned, k, present, load(free, k, present) * load(mobility, k, present) * follows)


@njit(**FAST)
def dot(begin, end, left, right, sums):
    """Fill sums (blocks,) with the block sums of left (N,) times right (N,), in the product of their units, as [m2/s2]."""
    for block in range(begin, end, BLOCK):
        last, product = min(block + BLOCK, end), spread(ZERO)
        for k in range(block, last, LANES):
            present = below(last, k)
            product += load(left, k, present) * load(right, k, present)
        sums[block // BLOCK] = summed(product)


@njit(**FAST)
def left_over(begin, end, group, pressures, closed, free, sums):
    """Add up the residual over a group, with what clamping negative pressures would add to it.

    group (K,): particles; pressures: `Pressures`; closed: whether the pressure has no bound; free (N,): 1 in the free set, 0 elsewhere;
    sums (blocks,): become block sums [1/s].
    """
    kappa, gradient, diagonal = pressures
    for block in range(begin, end, BLOCK):
        left = 0.0
        for n in range(block, min(block + BLOCK, end)):
            i = group[n]
            left += abs(gradient[i]) if free[i] > ZERO else max(-gradient[i], ZERO)
            if not closed:
                left += diagonal[i] * max(-kappa[i], ZERO)
        sums[block // BLOCK] = left
