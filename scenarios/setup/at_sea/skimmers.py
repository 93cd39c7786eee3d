"""Skimmers of a run without particles: built on the slick, and connected to the bodies that carry them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product

import numpy as np

from booms.deployment import BoomLayout
from booms.recovery.skimming import SkimmingParticipant
from coupling.bullet.assembly import BODIES
from coupling.master.connection import Connection
from coupling.participants.slick import SlickParticipant
from scenarios.schema.exercise import body_of, segment_names
from scenarios.schema.recovery import SkimmerSettings


def build_skimmers(
    settings_of: Mapping[str, SkimmerSettings], slicks: Sequence[SlickParticipant], booms: Mapping[str, BoomLayout]
) -> tuple[SkimmingParticipant, ...]:
    """Build skimmers by their settings; none without oil on the water."""
    found = []
    for slick, (name, settings) in product(slicks, settings_of.items()):
        body, offset = settings.on, np.array([*settings.place, 0.0])
        if body is not None and body in booms:
            count = len(booms[body].segments)
            body = segment_names(body, count)[count // 2 if settings.segment is None else settings.segment]
        elif body is not None:
            body = body_of(body)
        design = settings.design(slick.slick.settings.water_density)
        one = SkimmingParticipant(f"skimmers/{name}", design, slick, body=body, offset=offset)
        one.skimmer.is_running = settings.running
        found.append(one)
    return tuple(found)


def skimmer_connections(skimmers: tuple[SkimmingParticipant, ...]) -> tuple[Connection, ...]:
    """List the connections that tell the skimmers where their bodies are."""
    return tuple(
        Connection(BODIES, name, skimmer.name, name)
        for skimmer in skimmers
        for name in skimmer.variables
        if name.endswith((".pose", ".twist"))
    )
