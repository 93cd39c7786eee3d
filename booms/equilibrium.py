"""The shape of booms that hang in a stream and are tied to each other: V sweeps with cross bridles, sweeps with an open apex.

In plan, the water presses on a segment along its normal only, f = q l |U . n| (U . n) n, with U the stream's direction and q the same for
the whole boom. Tension P [N] as a vector falls along the boom by what acts on it, P_after = P_before - f, and a segment lies along the
tension at its middle. A tie is a line of fixed length between two joints. Unknown are the angles of all segments, the pull at ends that
are held, the places of ends that are free, and the tensions of the ties; scipy's `root` solves for them together, first with ties as long
as the booms' own catenaries leave them, then in steps down to their length. The shape does not depend on the speed, and on the skirts'
depths only by their ratio.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import root

from oilsim.backend.arrays import Array

# steps from the ties' first length to their own; numerical
STEPS = 5
# [1] largest residual of a solution, in lengths of the longest boom and in its whole load; numerical
TOLERANCE = 1e-7


@dataclass(frozen=True, kw_only=True, eq=False)
class HangingBoom:
    """A boom that hangs: its line (S + 1, 2) [m] without ties, relative load per metre, and whether its two ends are held there."""

    line: Array
    load: float
    held: tuple[bool, bool]


@dataclass(frozen=True, kw_only=True)
class Tie:
    """A line of `length` [m] between two joints, each the name of a boom and a number, 0 at its first end."""

    name: str
    ends: tuple[tuple[str, int], tuple[str, int]]
    length: float


def tied_lines(booms: Mapping[str, HangingBoom], ties: Sequence[Tie], stream: float) -> dict[str, Array]:
    """Compute the lines (S + 1, 2) [m] of booms, by name, that ties hold together in a stream to the direction `stream` [rad].

    Raises ValueError for ties that would be slack, and for booms and ties that hang in no shape.
    """
    net = _Net(booms, ties, stream)
    first = np.array([net.distance(net.start, tie) for tie in ties])
    last = np.array([tie.length for tie in ties]) / net.scale
    state = net.start
    for step in range(STEPS + 1):
        lengths = first + (last - first) * step / STEPS
        found = root(net.residual, state, args=(lengths,), method="hybr")
        state = found.x
    if not np.abs(net.residual(state, last)).max() < TOLERANCE:
        raise ValueError(
            f"booms and ties hang in no shape, least of all {net.worst(state, last)}, allowed: ties that reach, and ends near the place"
            " where they hang"
        )
    for tie, tension in zip(ties, net.tensions(state), strict=True):
        if tension <= 0.0:
            raise ValueError(f"tie {tie.name!r} would be slack, allowed: one shorter than {tie.length:g} m")
    if (slack := net.pushed(state)) is not None:
        raise ValueError(f"boom {slack!r} would be pushed together, allowed: ties that pull its ends apart")
    return net.lines(state)


class _Net:
    """Booms and ties in the frame of the stream: x across it, y along it; lengths in those of the longest boom, forces in its load."""

    def __init__(self, booms: Mapping[str, HangingBoom], ties: Sequence[Tie], stream: float) -> None:
        self._booms, self._ties = booms, tuple(ties)
        lengths = {name: float(np.hypot(*np.diff(one.line, axis=0).T).sum()) for name, one in booms.items()}
        self.scale = max(lengths.values())
        heaviest = max(one.load for one in booms.values())
        c, s = math.cos(stream), math.sin(stream)
        self._turn = np.array([[s, -c], [c, s]])  # rows: across, along
        self._link = {n: lengths[n] / self.scale / (len(one.line) - 1) for n, one in booms.items()}
        self._load = {n: self._link[n] * one.load / heaviest for n, one in booms.items()}
        self._line = {n: one.line @ self._turn.T / self.scale for n, one in booms.items()}
        self._places: dict[str, slice] = {}
        row = 0
        for name, one in booms.items():  # angles, then pull at the first end if it is held, else its place
            self._places[name] = slice(row, row + len(one.line) + 1)
            row += len(one.line) + 1
        self._tie_rows = slice(row, row + len(ties))
        self.start = self._guess(row + len(ties))

    def distance(self, state: Array, tie: Tie) -> float:
        """Return the distance between the ends of a tie."""
        (one, first), (two, second) = tie.ends
        return float(np.linalg.norm(self._chain(state, two)[second] - self._chain(state, one)[first]))

    def tensions(self, state: Array) -> Array:
        """Return the tensions of the ties."""
        return np.asarray(state[self._tie_rows])

    def pushed(self, state: Array) -> str | None:
        """Return the first boom that pressure, not tension, would hold at a segment; None if there is none."""
        pulls = self._pulls(state)
        for name in self._booms:
            if not (np.einsum("sk,sk->s", pulls[name][:-1], _along(self._angles(state, name))) > 0.0).all():
                return name
        return None

    def worst(self, state: Array, lengths: Array) -> str:
        """Return the boom or tie that is farthest from equilibrium, in words; lengths: of the ties."""
        missing = np.abs(self.residual(state, lengths))
        of_booms = {f"boom {name!r}": missing[self._places[name]].max() for name in self._booms}
        of_ties = {f"tie {tie.name!r}": one for tie, one in zip(self._ties, missing[self._tie_rows], strict=True)}
        found = {name: math.inf if math.isnan(value) else float(value) for name, value in (of_booms | of_ties).items()}
        return max(found, key=lambda name: found[name])

    def lines(self, state: Array) -> dict[str, Array]:
        """Return the booms' lines (S + 1, 2) [m] in the world."""
        return {name: self.scale * self._chain(state, name) @ self._turn for name in self._booms}

    def residual(self, state: Array, lengths: Array) -> Array:
        """Return what is missing to equilibrium, as many numbers as `state` has; lengths: of the ties."""
        pulls, missing = self._pulls(state), list[Array]()
        for name, one in self._booms.items():
            along = _along(self._angles(state, name))
            pull = pulls[name][:-1]
            missing.append(pull[:, 0] * along[:, 1] - pull[:, 1] * along[:, 0])
            missing.append(self._chain(state, name)[-1] - self._line[name][-1] if one.held[1] else pulls[name][-1])
        missing.append(np.array([self.distance(state, tie) for tie in self._ties]) - lengths)
        return np.concatenate(missing)

    def _guess(self, size: int) -> Array:
        """Return the booms' own shapes, with the pulls and tensions that come nearest to holding them."""
        state = np.zeros(size)
        for name, one in self._booms.items():
            links = np.diff(self._line[name], axis=0)
            last = np.zeros(2) if one.held[0] else self._line[name][0]
            state[self._places[name]] = np.concatenate([np.arctan2(links[:, 1], links[:, 0]), last])
        linear = [self._places[n].stop - k for n, one in self._booms.items() if one.held[0] for k in (2, 1)]
        linear += range(self._tie_rows.start, self._tie_rows.stop)
        lengths = np.array([self.distance(state, tie) for tie in self._ties])
        base = self.residual(state, lengths)
        columns = []
        for row in linear:
            moved = state.copy()
            moved[row] = 1.0
            columns.append(self.residual(moved, lengths) - base)
        state[linear] = np.linalg.lstsq(np.stack(columns, axis=1), -base, rcond=None)[0]
        return state

    def _angles(self, state: Array, name: str) -> Array:
        return np.asarray(state[self._places[name]][:-2])

    def _chain(self, state: Array, name: str) -> Array:
        """Return the joints (S + 1, 2) of a boom."""
        first = self._line[name][0] if self._booms[name].held[0] else state[self._places[name]][-2:]
        links = self._link[name] * _along(self._angles(state, name))
        return np.concatenate([first[None], first + np.cumsum(links, axis=0)])

    def _pulls(self, state: Array) -> dict[str, Array]:
        """Return the tension of each boom at the middle of its segments, and beyond its second end (S + 1, 2)."""
        given = {name: np.zeros((len(one.line), 2)) for name, one in self._booms.items()}  # on the joints
        for tie, tension in zip(self._ties, state[self._tie_rows], strict=True):
            (one, first), (two, second) = tie.ends
            way = self._chain(state, two)[second] - self._chain(state, one)[first]
            pull = tension * way / max(float(np.linalg.norm(way)), 1e-12)
            given[one][first] += pull
            given[two][second] -= pull
        found = {}
        for name, boom in self._booms.items():
            angle = self._angles(state, name)
            normal, across = np.stack([-np.sin(angle), np.cos(angle)], axis=1), np.cos(angle)
            load = self._load[name] * (np.abs(across) * across)[:, None] * normal
            if boom.held[0]:
                given[name][0] += state[self._places[name]][-2:]
            before = -np.cumsum(given[name], axis=0)  # by ends and ties alone
            middle = before[:-1] - np.cumsum(load, axis=0) + 0.5 * load
            found[name] = np.concatenate([middle, before[-1:] - load.sum(axis=0)])
        return found


def _along(angle: Array) -> Array:
    """Return unit vectors (S, 2) along segments of angles (S,) [rad]."""
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)
