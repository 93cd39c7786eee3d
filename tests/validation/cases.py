"""The registry of cases, by number."""

from __future__ import annotations

from tests.validation.case import Case
from tests.validation.hydrostatics import STILL_COLUMN, TWO_LAYERS
from tests.validation.viscous import INVISCID_SHEAR, SHEAR_WAVE, TAYLOR_GREEN
from tests.validation.waves import INTERFACE_WAVE, STANDING_WAVE

CASES: tuple[Case, ...] = tuple(
    sorted(
        (STILL_COLUMN, TWO_LAYERS, SHEAR_WAVE, INVISCID_SHEAR, TAYLOR_GREEN, STANDING_WAVE, INTERFACE_WAVE),
        key=lambda case: case.number,
    )
)


def select(names: str) -> list[Case]:
    """The cases named or numbered in a comma-separated list, all for an empty one; ValueError for one that does not exist."""
    wanted = [name.strip() for name in names.split(",") if name.strip()]
    known = {case.name: case for case in CASES} | {str(case.number): case for case in CASES}
    for name in wanted:
        if name not in known:
            raise ValueError(f"case {name!r} does not exist, allowed: {', '.join(case.name for case in CASES)}")
    return [case for case in CASES if not wanted or case.name in wanted or str(case.number) in wanted]
