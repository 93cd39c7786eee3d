"""The slick of a run, all its oil outside windows' particles, in the terms of the ledger, of frames and of pages."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from booms.boom_state import nearest_image, signed_distance
from booms.containment import Containment, fates_of
from oilsim.backend.arrays import Array, Flags, Index, Real
from oilsim.oil.fates import CAUSES, Fate
from oilsim.oil.ledger import BoomOil
from recordings.model.frame import PhaseFrame

if TYPE_CHECKING:
    from coupling.participants.slick import SlickParticipant
    from oilsim.sea import Sea
    from oilsim.slick.parcels import Parcels, Rows
    from oilsim.slick.slick import Slick


BANKED_UP = 0.01  # [m] thickest that a film is drawn so that it ends at a barrier; all oil above 0.2 mm has one colour


def oil_of_boom(slick: SlickParticipant, boom: str) -> BoomOil:
    """Return the oil of a boom; what no particle carried past it is modelled."""
    lost = {cause: float(slick.get(f"{boom}.passed.{cause}")) for cause in CAUSES}
    contained, afloat = float(slick.get(f"{boom}.contained")), float(slick.get("afloat"))
    return BoomOil(
        contained=contained,
        inside=contained,
        outside=afloat,
        afloat=afloat,
        lost=lost,
        lost_modelled={cause: volume - float(slick.get(f"{boom}.carried.{cause}")) for cause, volume in lost.items()},
        recontained=float(slick.get(f"{boom}.recontained")),
    )


def volume_within(slick: SlickParticipant, corners: Array) -> float:
    """Return the oil [m3] on the water and ashore within a polygon of corners (K, 2) [m]."""
    parcels = slick.slick.parcels
    there = parcels.there()
    if not there.any():
        return 0.0
    within = signed_distance(parcels.position[there], corners)[0] > 0.0
    return float(parcels.volume[there][within].sum())


def volume_ahead(
    oil: tuple[Array, Index, Sequence[SlickParticipant]],
    line: Array,
    boom: Containment,
) -> float:
    """Return the oil [m3] that a boom may still meet, ahead of its mouth or on its way into it: afloat, and neither held nor lost.

    line (S + 1, 2) [m] of the boom; oil: positions (N, 3) [m] and ids (N,) of particles, or one slick.
    """
    position, ids, slicks = oil
    for one in slicks:
        parcels = one.slick.parcels
        afloat = parcels.fate_codes() == Fate.AFLOAT
        return float(parcels.volume[afloat][is_ahead(parcels.position[afloat], line)].sum())
    afloat = fates_of([boom], ids).fate == Fate.AFLOAT
    places = nearest_image(position[afloat, :2], line.mean(axis=0), boom.options.period)
    return float(is_ahead(places, line).sum()) * boom.options.particle_volume


def is_ahead(places: Array, line: Array) -> Flags:
    """Tell which places (N, 2) [m] lie within a boom, or beyond the line through its ends where its mouth opens; line (S + 1, 2)."""
    middle = 0.5 * (line[0] + line[-1])
    across = line[-1] - line[0]
    out = np.array([-across[1], across[0]])
    out *= np.sign(float((middle - line.mean(axis=0)) @ out))
    beyond = (places - middle) @ out > 0.0
    return np.asarray(beyond | (signed_distance(places, line)[0] > 0.0))


def phase_of(slick: SlickParticipant, oil: int, sea: Sea, time: float) -> PhaseFrame:
    """Return the parcels of an oil (`Oil.number`) that no skimmer has taken as particles, on the surface of the sea at `time` [s].

    Resolved ones are where their particles are.
    """
    parcels = slick.slick.parcels
    position = np.column_stack([parcels.position, sea.elevation(parcels.position, time)]).astype(np.float32)
    if slick.particles is not None:
        rows, places = slick.particles.places(parcels, time)
        position[rows] = places
    order = np.argsort(parcels.id, kind="stable")
    shown = order[(parcels.there() & (parcels.oil == oil))[order]]
    volume = parcels.volume[shown]
    width = np.sqrt(volume / film_thickness(parcels, shown))
    return PhaseFrame(
        position=position[shown],
        id=parcels.id[shown].astype(np.uint32),
        volume=volume.astype(np.float32),
        width=width.astype(np.float32),
        fate=parcels.fate_codes()[shown].astype(np.uint8),
    )


def film_thickness(parcels: Parcels, rows: Rows) -> Array:
    """Return the thickness (M,) [m] of the oil at parcels of rows (M,), no less than oil of their volume would have by itself at last."""
    from oilsim.slick.gradient_flow import final_thickness

    return np.maximum(parcels.thickness[rows], final_thickness(parcels.volume[rows]))


def spots_of_slick(slick: Slick) -> Real:
    """Return the parcels that are not recovered as spots (N, 5): x, y, radius, thickness [m], fate; area times thickness is the volume.

    No spot is wider than oil of its volume would spread by itself (`final_thickness`). One beside a boom, a hull or a shore ends there:
    it is so much thicker, up to `BANKED_UP`, and then lies so much farther off.
    """
    from oilsim.slick.crossing import nearest_on_barriers

    parcels = slick.parcels
    shown = np.flatnonzero(parcels.there())
    volume, place = parcels.volume[shown], parcels.position[shown]
    thickness = film_thickness(parcels, shown)
    radius = np.sqrt(volume / (np.pi * thickness))
    off = place - nearest_on_barriers(place, slick.barriers)
    distance = np.linalg.norm(off, axis=1)
    room = np.maximum(distance, np.sqrt(volume / (np.pi * BANKED_UP)))
    ends = room < radius
    radius[ends] = room[ends]
    thickness[ends] = volume[ends] / (np.pi * room[ends] ** 2)
    across = (distance < radius) & (distance > 0.0)
    place[across] += off[across] * (radius[across] / distance[across] - 1.0)[:, None]
    return np.column_stack([place, radius, thickness, parcels.fate_codes()[shown]]).astype(np.float32)
