"""Lagged viscosity: a liquid so thin that one step changes nothing gets the viscosity of many steps at once.

Each liquid has its own lag t, so that sea water beside thick oil costs no more than alone. The shear between two liquids goes
with the thinner one: their harmonic mean is its viscosity, or up to twice that.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Double = NDArray[np.float64]

# [1] nu t / d^2 up to which viscosity waits; theory; decay of the finest wave, of 2 d, is off by (10 of this)^2 / 2
NEGLIGIBLE = 1e-3


class Due(NamedTuple):
    """The viscosity that is due in a step.

    span    time for which it acts [s], 0 if none is due
    matrix  (P, P) float32, viscosities of pairs of the P liquids [Pa s]
    number  largest viscous number nu t / d^2 [1]
    lagged    (P,) time for which each liquid's viscosity lags after the step [s]
    """

    span: float
    matrix: NDArray[np.float32]
    number: float
    lagged: Double


def viscosity_due(
    lagged: Double, viscosity: Double, matrix: NDArray[np.float32], per_number: Double, least: float
) -> Due:
    """Return the viscosity that is due of P liquids.

    lagged        (P,) time for which each liquid's viscosity lags [s]
    viscosity   (P,) [Pa s], 0 of liquids that are absent
    matrix      (P, P) float32, viscosities of pairs [Pa s]
    per_number  (P,) rho d^2 [kg/m]
    least       viscous number from which on a liquid's viscosity is due [1]
    """
    number = viscosity * lagged / per_number
    due = (viscosity > 0.0) & (number >= least)
    span = float(lagged[due].max(initial=0.0))
    rank = np.argsort(np.argsort(viscosity, kind="stable"))
    thinner = np.where(rank[:, None] < rank, *np.indices(matrix.shape))
    share = np.divide(lagged, span, out=np.zeros_like(lagged), where=due)[thinner]
    return Due(span, matrix * share.astype(np.float32), float(number[due].max(initial=0.0)), np.where(due, 0.0, lagged))
