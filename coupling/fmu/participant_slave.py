"""The FMI interface of a participant, which runs inside an FMU that `coupling.fmu.export` built.

The slave's class mixes `ParticipantSlave` into `pythonfmu.Fmi2Slave` or `pythonfmu3.Fmi3Slave`, which come with the FMU; oilsim itself is
imported from the Python that hosts the FMU. The code does not change the working directory, the environment or the module path of the
host. Every instance has its own participant, so that several can run in one process.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from coupling.master.participant import Causality, Participant, Status, StepResult, Variable
from coupling.master.stepper import EVENT_ROUNDS, PARTS_ALLOWED, TIME_TOLERANCE
from coupling.master.units import BASE, SYMBOLS, read_unit
from recordings.files.checkpoint import state_from_bytes, state_to_bytes

ENDED = "asks to end the run"  # said with the last step, since PythonFMU's binary tells an end from a discard by nothing else
CAUSALITIES = {Causality.INPUT: "input", Causality.OUTPUT: "output", Causality.PARAMETER: "parameter"}


class ParticipantSlave:
    """Adapts a participant, which `factory` creates, to the FMI interface.

    factory: ``package.module:callable``. The callable takes the FMU's resource folder, a `pathlib.Path`, and returns a `Participant` whose
    variables are numbers, of the shape () or (1,), and whose inputs and parameters have values from the start. experiment: the start time,
    stop time and step size [s] that the FMU proposes.
    """

    library: ClassVar[str]  # the module that the slave comes from
    prefix: ClassVar[str]  # of its classes' names
    number: ClassVar[str]  # its class of a floating-point variable
    factory: ClassVar[str]
    experiment: ClassVar[tuple[float, float, float]]
    description: str
    vars: Mapping[int, Any]  # of pythonfmu's slave

    def __init__(self, **keywords: Any) -> None:
        super().__init__(**keywords)
        module, _, name = self.factory.partition(":")
        self.participant: Participant = getattr(importlib.import_module(module), name)(Path(keywords["resources"]))
        self._start_time = self.experiment[0]
        self._time = self._start_time
        for variable in self.participant.variables.values():
            self._register(variable)

    def setup_experiment(self, start_time: float, *_: object) -> None:
        """Set the start time [s], which the master gives."""
        self._start_time = self._time = start_time

    def enter_initialization_mode(self) -> None:
        """Let the participant enter its initialization mode."""
        self.participant.enter_initialization_mode(self._start_time)

    def exit_initialization_mode(self) -> None:
        """Let the participant leave its initialization mode."""
        self.participant.exit_initialization_mode()

    def advance(self, time: float, step_size: float) -> StepResult:
        """Step the participant from `time` to `time + step_size` [s]; RuntimeError if it fails.

        After an early return it is stepped on at once with the same inputs, because neither binary can tell its master the time reached.
        """
        reached, part = time, step_size
        for _ in range(PARTS_ALLOWED):
            result = self.participant.do_step(reached, part)
            if result.status is Status.DISCARD and reached == time:
                self._tell(result.message or "no reason given")
                return result
            reached = result.last_successful_time
            if result.status not in (Status.OK, Status.EARLY_RETURN):
                raise RuntimeError(f"{result.status.value} at {reached:g} s: {result.message}")
            self._time = reached
            if result.event_handling_needed:
                self._settle_events(reached)
            if result.terminate_simulation:
                self._tell(f"{ENDED}: {result.message or 'no reason given'}")
            part = time + step_size - reached
            if result.terminate_simulation or result.status is Status.OK or part <= TIME_TOLERANCE * step_size:
                return result
        raise RuntimeError(f"stopped at {reached:g} s, allowed: {time + step_size:g} s")

    def terminate(self) -> None:
        """Terminate the participant."""
        self.participant.terminate()

    def _get_fmu_state(self) -> dict[str, Any]:
        return {"time": self._time, "participant": self.participant.save_state()}

    def _set_fmu_state(self, state: dict[str, Any]) -> None:
        self._time = state["time"]
        self.participant.restore_state(state["participant"])

    @staticmethod
    def _fmu_state_to_bytes(state: dict[str, Any]) -> bytes:
        return state_to_bytes(state)

    @staticmethod
    def _fmu_state_from_bytes(data: bytes) -> dict[str, Any]:
        return state_from_bytes(data)

    def _settle_events(self, time: float) -> None:
        """Update the discrete states; RuntimeError if they do not settle."""
        for _ in range(EVENT_ROUNDS):
            if not self.participant.update_discrete_states():
                return
        raise RuntimeError(f"discrete states do not settle at {time:g} s")

    def _tell(self, text: str) -> None:
        """Send a message to the master."""
        enums = importlib.import_module(f"{self.library}.enums")
        self.log(text, getattr(enums, f"{self.prefix}Status").warning)  # type: ignore[attr-defined]  # of pythonfmu's slave

    def _register(self, variable: Variable) -> None:
        """Register a variable of the participant as one of the FMU; ValueError for an array."""
        if int(np.prod(variable.shape)) != 1:
            raise ValueError(f"variable {variable.name!r} has shape {variable.shape}, allowed: a number, () or (1,)")
        name, shape = variable.name, variable.shape
        self._add_number(
            name,
            CAUSALITIES[variable.causality],
            "fixed" if variable.causality is Causality.PARAMETER else "continuous",
            getter=lambda: float(self.participant.get(name).item()),
            setter=lambda value: self.participant.set(name, np.full(shape, value)),
        )

    def _add_number(self, name: str, causality: str, variability: str, **access: Any) -> None:
        """Register a floating-point variable of the FMU; `access`: its getter and setter."""
        fmi = importlib.import_module(self.library)
        entry = getattr(fmi, self.number)(
            name,
            causality=getattr(getattr(fmi, f"{self.prefix}Causality"), causality),
            variability=getattr(getattr(fmi, f"{self.prefix}Variability"), variability),
            **access,
        )
        self.register_variable(entry, nested=False)  # type: ignore[attr-defined]  # of pythonfmu's slave

    def _describe_units(self, root: Element, elements: Mapping[str, Element]) -> None:
        """Set the units of `elements`, the variables by name, and declare these units behind the element CoSimulation."""
        units = Element("UnitDefinitions")
        for unit in dict.fromkeys(variable.unit for variable in self.participant.variables.values()):
            SubElement(SubElement(units, "Unit", {"name": unit}), "BaseUnit", _base_unit(unit))
        root.insert([child.tag for child in root].index("CoSimulation") + 1, units)
        for name, variable in self.participant.variables.items():
            elements[name].set("unit", variable.unit)
        root.set("variableNamingConvention", "flat")


def _base_unit(unit: str) -> dict[str, str]:
    """Return exponents of the SI base units, factor and offset, as FMI writes them; ValueError for a unit that is not known."""
    known = read_unit(unit)
    if known is None:
        raise ValueError(f"unit {unit!r} is not known, allowed: products of {', '.join(SYMBOLS)}")
    attributes = {base: str(power) for base, power in zip(BASE, known.exponents, strict=True) if power}
    plain = {"factor": 1.0, "offset": 0.0}
    return attributes | {
        name: str(getattr(known, name)) for name, value in plain.items() if getattr(known, name) != value
    }


class Slave2(ParticipantSlave):
    """Adapts a participant to FMI 2, to be mixed into `pythonfmu.Fmi2Slave`."""

    library, prefix, number = "pythonfmu", "Fmi2", "Real"

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Make a step by `advance`; return False for a discarded step and for the last one.

        In FMI 2 a step that ends the run is a discard, and the status fmi2Terminated distinguishes it from others.
        """
        result = self.advance(current_time, step_size)
        return result.status is not Status.DISCARD and not result.terminate_simulation

    def to_xml(self, *arguments: Any) -> Element:
        """Write the model description, with units and the initial unknowns that FMI 2 requires."""
        root: Element = super().to_xml(*arguments)  # type: ignore[misc]
        variables = root.findall("ModelVariables/ScalarVariable")
        self._describe_units(root, {str(v.get("name")): v[0] for v in variables})
        structure = root.find("ModelStructure")
        if structure is not None:
            unknowns = SubElement(structure, "InitialUnknowns")
            for index, variable in enumerate(variables, start=1):
                if variable.get("causality") == "output":
                    SubElement(unknowns, "Unknown", {"index": str(index)})
        return root


class Slave3(ParticipantSlave):
    """Adapts a participant to FMI 3, to be mixed into `pythonfmu3.Fmi3Slave`."""

    library, prefix, number = "pythonfmu3", "Fmi3", "Float64"

    def __init__(self, **keywords: Any) -> None:
        super().__init__(**keywords)
        name = (
            "time" if "time" not in self.participant.variables else "independent_time"
        )  # FMI asks for one, of any name
        self._add_number(name, "independent", "continuous", getter=lambda: self._time)

    def do_step(self, current_time: float, step_size: float) -> Any:
        """Make a step by `advance`; the binary reports the last step as a whole one, even if it ended early."""
        fmi = importlib.import_module("pythonfmu3")
        result = self.advance(current_time, step_size)
        status = fmi.Fmi3Status.discard if result.status is Status.DISCARD else fmi.Fmi3Status.ok
        return fmi.Fmi3StepResult(status=status, terminateSimulation=result.terminate_simulation)

    def to_xml(self, *arguments: Any) -> Element:
        """Write the model description, with units."""
        root: Element = super().to_xml(*arguments)  # type: ignore[misc]
        variables = root.findall("ModelVariables/Float64")
        self._describe_units(root, {str(v.get("name")): v for v in variables})
        return root
