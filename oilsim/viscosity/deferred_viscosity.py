"""Which viscosity is due in a step: liquids so thin that a step changes nothing are owed it, and get it for all that time at once.

Each liquid has a time t of its own, so that sea water beside thick oil costs no more than alone. The shear between two liquids goes with
the thinner one: their harmonic mean is its viscosity, or up to twice that.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Double = NDArray[np.float64]

NEGLIGIBLE = 1e-3  # nu t / d^2 that a liquid may be owed: what decays on the finest wave, one of 2 d, is off by (10 of this)^2 / 2


class Due(NamedTuple):
    """What a step must do: for `span` [s] with the viscosities `matrix` (P, P) [Pa s], of viscous number `number` at most.

    owed (P,) [s]: for which time viscosity is owed after it.
    """

    span: float
    matrix: NDArray[np.float32]
    number: float
    owed: Double


def viscosity_due(
    owed: Double, viscosity: Double, matrix: NDArray[np.float32], per_number: Double, least: float
) -> Due:
    """Of liquids owed their `viscosity` (P,) [Pa s], 0 of those that are not there, for the times `owed` (P,) [s].

    matrix (P, P): of pairs [Pa s]; per_number (P,): rho d^2 [kg/m]; least: viscous number from which on a liquid's is due.
    """
    number = viscosity * owed / per_number
    due = (viscosity > 0.0) & (number >= least)
    span = float(owed[due].max(initial=0.0))
    rank = np.argsort(np.argsort(viscosity, kind="stable"))
    thinner = np.where(rank[:, None] < rank, *np.indices(matrix.shape))
    share = np.divide(owed, span, out=np.zeros_like(owed), where=due)[thinner]
    return Due(span, matrix * share.astype(np.float32), float(number[due].max(initial=0.0)), np.where(due, 0.0, owed))
