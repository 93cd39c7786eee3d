"""Warnings of a run, each said once and by name.

They are of solves that end before their tolerance is met, of bodies that leave the tank, are too thin for their particles, or lie where
liquid was to start, of anchors that drag and of lines that part. Ties that a crew makes fast are said too.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from coupling.bullet.rigid_body_world import RigidBodyWorld
from coupling.multibody.lines import ElasticLine
from coupling.multibody.mooring_leg import MooringLeg
from oilsim import AdvanceReport, FluidConfig
from recordings.model.frame import EventLevel
from scenarios.setup.fill_lattice import misfits
from scenarios.spec.resolve import RunSpec
from scenarios.watch.boom_score import Notice

TOLD = 2.0  # times a tolerance that a solve may leave before it is said: less is the same flow
CROWDED = 0.02  # [1] mean compression of liquid in a closed box that is said; as it is filled, a box has less
DRAGGED = 0.1  # [m] that an anchor moves before it is said to drag; an anchor that takes hold moves as far


class Remarks:
    """The warnings of a run, checked after every communication step."""

    def __init__(
        self,
        liquid: RunSpec,
        world: RigidBodyWorld | None,
        left_out: Mapping[str, str],
        thin: Mapping[str, str],
        notes: Sequence[str] = (),
        facts: Sequence[str] = (),
    ) -> None:
        """Watch a run of this liquid.

        left_out: what bodies take of the liquid at the start, in words, by region; thin: warnings of `thin_bodies`; notes: what was mended
        of bodies' meshes; facts: what comes of settings, which is no warning.
        """
        self._fluid, self._tank, self._world = liquid.fluid, liquid.domain, world
        self._has_walls = liquid.in_tank
        self._left_out = left_out
        fluid = liquid.fluid
        self._misfits = misfits(liquid.fill, liquid.domain, fluid.particle_spacing, fluid.dimension)
        self._oil = {name for name, fill in liquid.fill.items() if liquid.phases[fill.phase].is_oil}
        self._notes, self._facts = tuple(notes), tuple(facts)
        self._thin = dict(thin)
        self._made: set[str] = set()

    def look(self, report: AdvanceReport | None) -> list[Notice]:
        """Return what is new after a step of which the fluid gave this report."""
        short = {} if report is None else dict(self._solves(report))
        short |= self._thin | dict(self._bodies()) | dict(self._lines())
        found = dict(self._fills()) | dict(self._ties())
        found |= {about: Notice(text, level="warning", source=about) for about, text in short.items()}
        if report is not None and report.drops:
            text = "drops of a few particles rise or sink as drops of their volume do (modelled; reported once)"
            found["drops"] = Notice(text, level="info", source="fluid")
        new = {about: remark for about, remark in found.items() if about not in self._made}
        self._made |= set(new)
        return list(new.values())

    def save_state(self) -> dict[str, Any]:
        """Return what has been said, as plain data."""
        return {"made": sorted(self._made)}

    def restore_state(self, saved: Mapping[str, Any]) -> None:
        """Go back to a state that `save_state` returned; ValueError for things said that are no texts."""
        if not all(isinstance(about, str) for about in saved["made"]):
            raise ValueError("remarks/made holds other things than texts, allowed: texts")
        self._made = set(saved["made"])

    def _fills(self) -> Iterator[tuple[str, Notice]]:
        """Liquid that particles do not fill exactly, or that bodies displace (of oil a loss of the slick), and meshes that were mended."""
        for name, text in self._left_out.items():
            level: EventLevel = "warning" if name in self._oil else "info"
            yield f"fill {name}", Notice(text, level=level, source="oilsim")
        for name, text in self._misfits.items():
            level = "warning" if name in self._oil else "info"
            yield f"misfit {name}", Notice(text, level=level, source="oilsim")
        for text in self._notes:
            yield text, Notice(text, level="warning", source="oilsim")
        for text in self._facts:
            yield text, Notice(text, level="info", source="oilsim")

    def _solves(self, report: AdvanceReport) -> Iterator[tuple[str, str]]:
        left = "a mean compression"
        solves = {
            "density": (report.density_error, FluidConfig.density_tolerance, "passes", left),
            "divergence": (report.divergence_error, self._fluid.divergence_tolerance, "products", left),
            "viscosity": (
                report.viscosity_error,
                FluidConfig.viscosity_tolerance,
                "iterations",
                "a share of the drag left",
            ),
        }
        if report.crowding > CROWDED:
            yield (
                "fluid crowded",
                f"liquid that fills its box is pressed together by {100.0 * report.crowding:.1f} % (reported once)",
            )
        for name, (error, tolerance, unit, left) in solves.items():
            if error > TOLD * tolerance:
                text = f"stopped after {report.iterations[name]:.0f} {unit} per step with {left} of {error:.2g}"
                yield (
                    f"fluid {name}",
                    f"{text}, above {tolerance:.2g}; a shorter fluid.maximum_time_step helps (reported once)",
                )

    def _lines(self) -> Iterator[tuple[str, str]]:
        """Lines that have parted, and anchors that have dragged."""
        if self._world is None:
            return
        for name in self._world.lines.names:
            line = self._world.lines[name]
            if line.parted:
                yield f"{name} parted", "has parted, and holds nothing any more"
            elif isinstance(line, MooringLeg) and line.dragged > DRAGGED:
                pull = line.pull_now
                text = f"drags its anchor: it is pulled by {pull.horizontal:.0f} N along the ground and {pull.at_anchor:.0f} N upwards"
                yield f"{name} anchor", text

    def _ties(self) -> Iterator[tuple[str, Notice]]:
        """Ties that a crew has made fast."""
        for name in () if self._world is None else self._world.lines.names:
            line = self._world.lines[name] if self._world is not None else None
            if isinstance(line, ElasticLine) and line.loosened and line.made_fast:
                text = f"has been made fast, and is hauled in to {line.laid_length:.3g} m"
                yield f"{name} made fast", Notice(text, level="info", source=name)

    def _bodies(self) -> Iterator[tuple[str, str]]:
        if self._world is None or not self._has_walls:
            return
        names = self._world.free_body_names
        places = self._world.poses(names)[:, :3]
        beyond = (places < np.array(self._tank.lower)) | (places > np.array(self._tank.upper))
        for row, axis in np.argwhere(beyond).tolist():
            name, sign = names[row], "-" if places[row, axis] < self._tank.lower[axis] else "+"
            side = f"{sign}{'xyz'[axis]}"
            if side in self._tank.open and side != "+z":  # from where it falls back
                yield f"body {name}", f"has left the tank through its open side {side}"
