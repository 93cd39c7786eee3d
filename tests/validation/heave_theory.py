"""Linear potential theory of a half-immersed cylinder let go in a tank: what heave decay tends to for small heaves.

Lengths in radii R, times in sqrt(R / g), densities in the liquid's. The potential phi obeys Laplace's equation,

    free surface z = 0:  eta_t = phi_n,  phi_t = -eta        walls and floor:  phi_n = 0        cylinder:  phi_n = n_z dz/dt
    (m + m_a) d2z/dt2 = -2 z - integral of phi_t n_z over the cylinder, as the free surface's phi_t alone makes it

n points out of the liquid. Green's third identity on straight panels of constant phi and phi_n,

    pi phi(x) = sum over panels of  phi int d(ln r)/dn - phi_n int ln r,

gives phi_n on the surface and phi on the rest from phi on the surface and the cylinder's speed; phi_t obeys the same equations. The
flow is even in x: panels lie at x > 0 and count with their images. Walls 14 R away in water 6 R deep are not far: the second extremum is
0.363 there, and 0.305 in a deep and wide sea (the table of Ursell's multipoles in `reference/`).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Double = NDArray[np.float64]

MASS = 0.5 * math.pi  # of a cylinder of half the density, over rho R^2 and length
ON_BODY = 24  # panels on the quarter circle
GROWTH, LONGEST = 1.06, 0.25  # of the free surface's panels from one to the next, and the longest [R]
FIXED = 0.25  # length of panels on wall and floor [R]
STEP = 0.02  # [sqrt(R / g)]


class Panels(NamedTuple):
    """Straight panels from `start` to `end` (n, 2) with the liquid's outside to their right; `kind` (n,): SURFACE, REST or BODY."""

    start: Double
    end: Double
    kind: NDArray[np.int64]


SURFACE, REST, BODY = range(3)


def tank_panels(half_width: float, depth: float) -> Panels:
    """Right half of the liquid's boundary, once round: free surface, wall, floor, cylinder."""
    lengths = [0.5 * math.pi / ON_BODY]
    while 1.0 + sum(lengths) < half_width:
        lengths.append(min(GROWTH * lengths[-1], LONGEST))
    across = 1.0 + np.concatenate([[0.0], np.cumsum(lengths)]) * (half_width - 1.0) / sum(lengths)
    surface = np.column_stack([across[::-1], np.zeros_like(across)])
    down = np.linspace(0.0, -depth, round(depth / FIXED) + 1)
    along = np.linspace(0.0, half_width, round(half_width / FIXED) + 1)
    turn = np.linspace(0.0, -0.5 * math.pi, ON_BODY + 1)
    body = np.column_stack([np.cos(turn), np.sin(turn)])
    floor = np.column_stack([along, np.full_like(along, -depth)])
    wall = np.column_stack([np.full_like(down, half_width), down])[::-1]
    lines = ((surface, SURFACE), (body, BODY), (floor, REST), (wall, REST))
    return Panels(
        np.concatenate([line[:-1] for line, _ in lines]),
        np.concatenate([line[1:] for line, _ in lines]),
        np.concatenate([np.full(len(line) - 1, kind) for line, kind in lines]),
    )


def integrals(start: Double, end: Double, at: Double) -> tuple[Double, Double]:
    """int ln r and int d(ln r)/dn over each panel, seen from the points `at` (m, 2): two of (m, n); the second is 0 on a panel itself."""
    tangent = end - start
    length = np.linalg.norm(tangent, axis=1)
    tangent = tangent / length[:, None]
    normal = np.column_stack([tangent[:, 1], -tangent[:, 0]])
    apart = at[:, None] - start[None]
    first, across = (apart * tangent).sum(axis=2), (apart * normal).sum(axis=2)
    last = first - length
    beside = np.abs(across) > 1e-12
    height = np.where(beside, across, 1.0)
    angle = np.where(beside, np.arctan(first / height) - np.arctan(last / height), 0.0)
    logarithm = 0.5 * (first * np.log(first**2 + across**2 + 1e-300) - last * np.log(last**2 + across**2 + 1e-300))
    return logarithm - length + across * angle, -angle


class LinearTank:
    """The linear map from phi on the free surface and the cylinder's speed to phi_n there and the impulse on the cylinder."""

    def __init__(self, half_width: float, depth: float) -> None:
        start, end, kind = tank_panels(half_width, depth)
        middle, mirror = 0.5 * (start + end), np.array([-1.0, 1.0])
        single, double = integrals(start, end, middle)
        # an image runs the other way round
        more = integrals(end * mirror, start * mirror, middle)
        single, double = single + more[0], double + more[1]
        # sum of the double layer is -pi off corners; taken from the rows, constants are exact
        double -= np.diag(double.sum(axis=1))
        surface, rest = kind == SURFACE, kind != SURFACE
        self.body = kind[rest] == BODY
        left = np.concatenate([-single[:, surface], double[:, rest]], axis=1)
        rise = np.where(self.body, -(end - start)[rest, 0], 0.0)  # n_z times length on the cylinder
        length = np.linalg.norm((end - start)[rest], axis=1)
        solution = np.linalg.solve(left, np.column_stack([-double[:, surface], single[:, rest] @ (rise / length)]))
        count = int(surface.sum())
        self.outflow, self.outflow_by_body = solution[:count, :-1], solution[:count, -1]
        self.impulse, self.impulse_by_body = (
            2.0 * rise @ solution[count:, :-1],
            float(2.0 * rise @ solution[count:, -1]),
        )

    @property
    def added_mass(self) -> float:
        """Of the cylinder at high frequency, over rho R^2."""
        return self.impulse_by_body

    def rate(self, state: Double) -> Double:
        """d/dt of z, dz/dt, eta and phi on the free surface, all in one array."""
        z, speed, (eta, phi) = state[0], state[1], state[2:].reshape(2, -1)
        pressure = float(self.impulse @ eta)  # of phi_t = -eta, n out of the liquid: F_z = int p n_z, p = -phi_t
        acceleration = (pressure - 2.0 * z) / (MASS + self.added_mass)
        return np.concatenate([[speed, acceleration], self.outflow @ phi + self.outflow_by_body * speed, -eta])


def heave_decay(half_width: float, depth: float, end: float) -> tuple[Double, Double]:
    """Time [sqrt(R / g)] and height over the first of a cylinder let go at rest (classical Runge-Kutta)."""
    tank = LinearTank(half_width, depth)
    state = np.zeros(2 + 2 * len(tank.outflow))
    state[0] = 1.0
    heights = [1.0]
    for _ in range(round(end / STEP)):
        one = tank.rate(state)
        two = tank.rate(state + 0.5 * STEP * one)
        three = tank.rate(state + 0.5 * STEP * two)
        four = tank.rate(state + STEP * three)
        state = state + STEP / 6.0 * (one + 2.0 * two + 2.0 * three + four)
        heights.append(float(state[0]))
    return STEP * np.arange(len(heights)), np.array(heights)
