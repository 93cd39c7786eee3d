"""Verdicts of checks: measured and expected value, tolerance, unit, and the particle spacing that would meet the tolerance."""

from __future__ import annotations

import math
from dataclasses import dataclass

FINEST_SHARE = 0.1  # [1] of the present spacing; a finer one costs 10^4 times the work, so another cause is likelier


@dataclass(frozen=True, kw_only=True)
class Context:
    """Circumstances of a measurement.

    bodies: names of the bodies measured. time [s]: of the moment, None for a whole run. spacing [m]: of the particles, None if the result
    does not depend on it.
    """

    bodies: tuple[str, ...] = ()
    time: float | None = None
    spacing: float | None = None


NO_CONTEXT = Context()


class CheckFailed(AssertionError):
    """A check that failed.

    measured, expected, tolerance: in `unit`; expected is None where only a limit is set. bodies, time [s]: where and when it failed.
    """

    def __init__(
        self, message: str, measured: float, expected: float | None, tolerance: float, unit: str, context: Context
    ) -> None:
        super().__init__(message)
        self.measured, self.expected, self.tolerance, self.unit = measured, expected, tolerance, unit
        self.bodies, self.time = context.bodies, context.time


def require_near(
    quantity: str, measured: float, expected: float, within: float, unit: str, context: Context = NO_CONTEXT
) -> None:
    """Require that `measured` is `expected` to `within`, all in `unit`; CheckFailed if not, ValueError for a tolerance below 0."""
    __tracebackhide__ = True  # pytest shows the check instead
    _require_tolerance(within, unit)
    error = abs(measured - expected)
    if error <= within:  # false for NaN
        return
    told = f"{quantity} is {_number(measured, unit)}, expected: {_number(expected, unit)} within {_number(within, unit, 3)}"
    raise CheckFailed(told + _circumstances(error, within, context), measured, expected, within, unit, context)


def require_at_most(
    quantity: str, measured: float, limit: float, unit: str, context: Context = NO_CONTEXT, *, verb: str = "is"
) -> None:
    """Require that `measured` is `limit` at most, both in `unit`; CheckFailed if not, ValueError for a limit below 0."""
    __tracebackhide__ = True
    _require_tolerance(limit, unit)
    if measured <= limit:
        return
    told = f"{quantity} {verb} {_number(measured, unit)}, expected: {_number(limit, unit, 3)} at most"
    raise CheckFailed(told + _circumstances(measured, limit, context), measured, None, limit, unit, context)


def _require_tolerance(value: float, unit: str) -> None:
    if not value >= 0.0:
        raise ValueError(f"tolerance is {_number(value, unit)}, allowed: 0 or more")


def _number(value: float, unit: str, digits: int = 5) -> str:
    return f"{value:.{digits}g} {unit}".strip()


def _circumstances(error: float, tolerance: float, context: Context) -> str:
    """Say when it was measured, with which particles, and which spacing would do."""
    when = "" if context.time is None else f" at {context.time:.6g} s"
    if context.spacing is None or not math.isfinite(error):
        return when
    needed = context.spacing * (tolerance / error)
    told = f"{when}; the particles are {context.spacing:.3g} m apart, and "
    if needed < FINEST_SHARE * context.spacing:
        return f"{told}no affordable spacing would meet this tolerance: look for another cause"
    return f"{told}{needed:.2g} m would meet this tolerance if the error shrinks with the spacing"
