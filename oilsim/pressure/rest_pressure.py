"""The pressure of water at rest acts by its own slope, not by sums over particles: a well-balanced scheme.

A sum over disordered neighbours is no exact gradient. Its error is proportional to the pressure, so particles deep down swing about their
places, the faster the deeper, which bounds the step (`time_step`). Below every free surface most of the pressure is known, that of water
at rest,

    q = share g dt f(s),   f = s^2 / 2b for 0 < s < b,  s - b / 2 beyond,   s = top - z,

whose `top` is the upper side of the deepest particle that lies at a free surface and is not pressed. The sums see what differs from it,
and its slope is that of the formula:

    v -= dt (rho_ref / rho_0) [ H (kappa - q) + grad q ].

H q and grad q agree within the error of the sums, so pressures are those of the full sums. Bodies feel what the liquid beside them feels:
the sums of kappa - q, and of q the lift of the volume that they displace,

    P = rho_ref sum_k V_k (-dq/dz)(z_k) (e_z, r_k x e_z)    over the places k that make up the body.

By the sums of q they would feel how the particles beside them lie: a sphere that moves by a third of a spacing gets a fiftieth of its lift
more or less, as much as half of a wave's force. The swings that q would cause are gone. What is left of the pressure keeps particles in
order, beside walls and bodies above all. So the share is what the step needs, at most SHARE, and none in short steps. The idea is that of
well-balanced schemes for shallow water and for the atmosphere (Audusse et al. 2004; Botta et al. 2004), which hold a still state exactly.
Momentum is kept as far as liquid and bodies fill the volume: pairs are antisymmetric, and the slope acts on both alike.

One liquid that fills its box has no surface that sets a top, and needs none. There the whole pressure at rest acts by its slope, which
takes off gravity's kick. The solve finds the reduced pressure kappa - dt (g . x - g . x_top), and bodies get Archimedes' lift by their
volume. So the liquid moves as without weight. With the whole pressure, an error of one per cent would be a tenth of the force that sinks a
body a tenth heavier than its liquid.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from oilsim.backend.arrays import Real
from oilsim.core.state import FluidState

# [d] of water whose weight presses a particle at a free surface at most; numerical; half of it presses the uppermost layer, and disorder
# deep inside, which looks like a surface, is pressed by more
BARE = 0.9
# [1] share of the pressure of water at rest that acts by its slope, at most; measured; the rest keeps particles in order: with 1, 0.8 and
# 0.5 water about a floating box moves four times, twice and half as fast again as with none
SHARE = 0.95
# [d] b, over which the slope grows to its whole; measured; sums resolve it, and with 1.5 a splash leaves windows worse
FADE = 2.0


# [d] from the middle of the deepest bare particle to the top; theory; half of it lies above its middle, where q is an eighth of the
# pressure under its own weight
RISE = 0.5


class RestPressure(NamedTuple):
    """The pressure of water at rest below `top` [m].

    impulse (N,)   q [m2/s]
    slope (N,)     -dq/dz [m/s], up to g dt
    """

    impulse: Real
    slope: Real


class RestLaw(NamedTuple):
    """The part of the pressure of water at rest that acts by its slope: top and spacing d [m], kick g dt [m/s], share [1]."""

    top: float
    spacing: float
    kick: float
    share: float = SHARE

    def of(self, height: NDArray[np.floating]) -> RestPressure:
        """Return q and its slope at `height` (N,) [m]."""
        fade, slope = np.float32(FADE * self.spacing), np.float32(self.share * self.kick)
        depth = np.maximum(np.float32(self.top) - height, np.float32(0.0))
        inside = np.minimum(depth, fade)
        impulse = slope * (np.float32(0.5) / fade * inside * inside + (depth - inside))
        return RestPressure(impulse, slope / fade * inside)


def top_of_rest(height: Real, surface: NDArray[np.uint8], impulse: Real, spacing: float, kick: float) -> float:
    """Return the height [m] below which the pressure of water at rest acts by its slope; infinitely deep without a free surface.

    height (N,) of the particles [m]; surface (N,): `FreeSurface` of each; impulse (N,): their last pressure kappa [m2/s]; spacing d [m];
    kick g dt [m/s].
    """
    bare = (surface > 0) & (impulse < np.float32(BARE * spacing * kick))
    return float(height[bare].min()) + RISE * spacing if bare.any() else -np.inf


def rest_impulse(position: Real, gravity: ArrayLike, potential: float, time_step: float) -> Real:
    """Return dt (g . x - potential) (N,) [m2/s], the pressure of liquid at rest times time over density.

    position x (3, N) [m]; gravity g (3,) [m/s2]; potential: g . x at its surface [m2/s2]; time_step dt [s].
    """
    return np.float32(time_step) * (np.asarray(gravity, np.float32) @ position - np.float32(potential))


def whole_impulse(state: FluidState, gravity: ArrayLike) -> Real:
    """Return the whole pressure times time over density (N,) [m2/s] of the last step; gravity (3,) [m/s2]."""
    if not state.is_reduced:
        return state.pressure_impulse
    return state.pressure_impulse + rest_impulse(state.position, gravity, state.rest_potential, state.time_step)


def needed_share(head: float, rest_head: float, allowed: float) -> float:
    """Return the share [1] that must act by its slope for the sums to see no more than the head `allowed`, at most SHARE.

    head: the highest pressure over density; rest_head: that of water at rest, by the whole of f, at the deepest particle; all [m2/s2].
    """
    return min(max(0.0, head - allowed) / rest_head, SHARE) if rest_head > 0.0 else 0.0
