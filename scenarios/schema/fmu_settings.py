"""FMUs that take part in a scenario."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from coupling.master.connection import Connection
from scenarios.schema.parsing.quantity_fields import Section
from scenarios.text.problems import Problem

PREFIX = "fmus."  # of an FMU's name as a participant, so that it cannot be taken for another
ORDER_BOARD, READING_BOARD = (
    "orders",
    "readings",
)  # the participants that FMUs are connected to, see `scenarios.controls.signals`


@dataclass(frozen=True, kw_only=True)
class FmuSettings(Section):
    """An FMU for co-simulation, FMI 2 or 3, that takes part in the run: a winch, an autopilot, a source of wind.

    file     file of the FMU; a relative path starts at the scenario file's folder
    start    values of its parameters, and start values of its inputs, by their names
    units    units of variables for which the FMU gives none: "kN", "kn", "deg"
    inputs   for each input by name, its source: a signal of the run, or fmus.NAME.OUTPUT of another FMU; others keep their start values
    outputs  for each output by name, the signal of the run that it drives; it overrides the scenario's own orders

    `oilsim signals FILE` lists the signals; docs/fmus tells more. Both ends of a connection must be numbers. Units are compared; if
    they differ and both are known, values are converted. At each communication point the FMUs step first, in the order of the file, then
    the helmsmen, the liquid and the bodies.
    """

    file: str
    start: Mapping[str, float | bool] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    inputs: Mapping[str, str] = field(default_factory=dict)
    outputs: Mapping[str, str] = field(default_factory=dict)

    def problems(self) -> Iterator[Problem]:
        """Check that start values are finite; an FMU would take others without complaint."""
        for name, value in self.start.items():
            if not math.isfinite(value):
                yield Problem(f"start.{name}", f"is {value}, allowed: a finite number")


def connections_of(fmus: Mapping[str, FmuSettings]) -> dict[str, Connection]:
    """List the connections of all FMUs by their places in the file."""
    connections = {}
    for name, settings in fmus.items():
        for variable, source in settings.inputs.items():
            participant, output = _end(source)
            connections[f"fmus.{name}.inputs.{variable}"] = Connection(participant, output, PREFIX + name, variable)
        for variable, target in settings.outputs.items():
            connections[f"fmus.{name}.outputs.{variable}"] = Connection(PREFIX + name, variable, ORDER_BOARD, target)
    return connections


def _end(source: str) -> tuple[str, str]:
    """Return participant and variable of ``vessels.port.speed`` or ``fmus.wind.speed``."""
    if source.startswith(PREFIX):
        name, _, variable = source.removeprefix(PREFIX).partition(".")
        return PREFIX + name, variable
    return READING_BOARD, source
