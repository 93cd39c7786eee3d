"""Reads the model description of an FMU by FMPy, adds the parts that FMPy leaves out, and checks that the FMU can run here.

Turns the variables of an FMU into those of a participant, with its arrays and units.

A unit keeps its name, with the dot of a product written as a space ("N m"), and its relation to SI, which FMI defines by exponents, factor
and offset. A variable whose elements have several units names each once ("N, N m"). If the FMU names no unit, the user may name it; else
the variable has none, "1".

Keeps the log messages of FMUs, which are not printed, so that an error can quote them.

FMPy formats the messages of FMI 2 in a native function that knows one logger for the whole process, the one registered last. So there is
one logger here, and the environment that each FMU is given identifies the sender of a message.
"""

from __future__ import annotations

import math
import shutil
import tempfile
import zipfile
from collections import Counter, deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from ctypes import byref
from dataclasses import replace
from itertools import count
from pathlib import Path, PurePosixPath
from weakref import WeakValueDictionary
from xml.etree import ElementTree

import fmpy
from fmpy import calloc, free
from fmpy.fmi2 import (
    addLoggerProxy,
    fmi2CallbackAllocateMemoryTYPE,
    fmi2CallbackFreeMemoryTYPE,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
)
from fmpy.model_description import ModelDescription, ModelVariable, read_model_description

from coupling.master.participant import ELEMENT, Causality, Numbers, Variable, variable_table
from coupling.master.units import BASE, Unit, read_unit

FILE = "modelDescription.xml"
LARGEST_DESCRIPTION = 256_000_000  # bytes; those of the largest models known have a fifth
LONGEST_NAME = 255  # bytes of a file's name
LARGEST_REFERENCE = 2**32 - 1


def read_description(path: Path) -> ModelDescription:
    """Read the model description of an FMU.

    Raises FileNotFoundError for a missing file, and ValueError, with every problem at once, for a file that is no FMU or cannot run here.
    """
    if path.is_dir():
        raise ValueError(f"FMU {path} is a folder, allowed: a file")
    if not path.is_file():
        raise FileNotFoundError(f"FMU {path} does not exist")
    try:
        with zipfile.ZipFile(path) as archive:
            _refuse_oversize(archive)
            root = ElementTree.fromstring(archive.read(FILE))
        missing = list(_missing(root))
        description = None if missing else read_model_description(str(path), validate=False)
    except Exception as cause:
        raise ValueError(f"{path} is no FMU: {cause}") from cause
    if description is None:
        raise ValueError(f"FMU {path} cannot be read: {FILE} " + "; ".join(missing))
    problems = _problems(path, description)
    if problems:
        raise ValueError(f"FMU {path} " + "; ".join(problems))
    _take_relative_quantities(root, description)
    return description


def _refuse_oversize(archive: zipfile.ZipFile) -> None:
    """ValueError for an archive that cannot be unpacked, by its own table of contents: a small file may hold terabytes."""
    described = archive.getinfo(FILE).file_size
    if described > LARGEST_DESCRIPTION:
        raise ValueError(f"its {FILE} has {described / 1e6:,.0f} MB, allowed: up to {LARGEST_DESCRIPTION / 1e6:g} MB")
    for entry in archive.infolist():
        parts = PurePosixPath(entry.filename).parts
        if any(len(part.encode()) > LONGEST_NAME for part in parts):
            raise ValueError(
                f"it holds a file of the name {entry.filename[:40]!r}..., allowed: up to {LONGEST_NAME} bytes"
            )
        if ".." in parts or entry.filename.startswith("/"):
            raise ValueError(f"it holds a file that leads out of it, {entry.filename[:80]!r}")
    size = sum(entry.file_size for entry in archive.infolist())
    free = shutil.disk_usage(tempfile.gettempdir()).free
    if size > free:
        raise ValueError(f"it unpacks to {size / 1e6:,.0f} MB, allowed: up to the {free / 1e6:,.0f} MB that are free")


def _missing(root: ElementTree.Element) -> Iterator[str]:
    """Yield entries that are missing or invalid; FMPy (0.3.32) fails on them with messages about its own code."""
    version = root.get("fmiVersion", "")
    if version[:2] not in ("2.", "3."):
        yield (
            f"has fmiVersion {version!r}, allowed: 2.0 or 3.0" if version else "has no fmiVersion, allowed: 2.0 or 3.0"
        )
    for variable in root.iterfind("ModelVariables/*[@name]"):
        reference = variable.get("valueReference", "").strip()
        if not (
            reference.isascii()
            and reference.isdecimal()
            and len(reference) <= 10
            and int(reference) <= LARGEST_REFERENCE
        ):
            text = f"has valueReference {reference!r}" if reference else "has no valueReference"
            yield f"{text} for variable {variable.get('name')!r}, allowed: a whole number"
        for dimension in variable.iterfind("Dimension[@valueReference]"):
            if not root.findall(f"ModelVariables/*[@valueReference='{dimension.get('valueReference')}'][@start]"):
                yield f"has no start value of a dimension of variable {variable.get('name')!r}"
    yield from _dangling(root)
    yield from _same_names(root)


def _same_names(root: ElementTree.Element) -> Iterator[str]:
    """Names that more than one variable has, those of aliases included, and aliases without one."""
    aliases = root.findall("ModelVariables/*/Alias")
    names = Counter(one.get("name") for one in (*root.findall("ModelVariables/*[@name]"), *aliases))
    if names.pop(None, 0):
        yield "has an Alias without a name"
    yield from (
        f"has {count} variables of the name {name!r}, allowed: one" for name, count in names.items() if count > 1
    )


def _dangling(root: ElementTree.Element) -> Iterator[str]:
    """Yield entries of the model structure for variables that do not exist: by index, from 1, in FMI 2; by value reference in FMI 3."""
    variables = root.findall("ModelVariables/*[@name]")
    known = {"index": {str(n + 1) for n in range(len(variables))}}
    known["valueReference"] = {variable.get("valueReference", "").strip() for variable in variables}
    for entry in root.iterfind("ModelStructure//*"):
        for key, there in known.items():
            if key in entry.attrib and entry.attrib[key].strip() not in there:
                yield f"has {key} {entry.attrib[key]!r} of no variable in its ModelStructure, under {entry.tag}"


def _problems(path: Path, description: ModelDescription) -> list[str]:
    """List the reasons why the FMU cannot run here."""
    problems = []
    if description.coSimulation is None:
        problems.append("has no co-simulation interface")
    platforms = fmpy.supported_platforms(str(path))
    if fmpy.platform not in platforms:
        problems.append(f"has binaries for {', '.join(platforms) or 'no platform'}, needed: {fmpy.platform}")
    return problems


def _take_relative_quantities(root: ElementTree.Element, description: ModelDescription) -> None:
    """Put `relativeQuantity` into the description's variables: FMPy (0.3.32) looks for it among their children.

    FMPy appends the further names of FMI 3's variables (section 2.4.7) as variables of their own, which have no element.
    """
    own = [variable for variable in description.modelVariables if variable.alias is None]
    for variable, element in zip(own, root.iterfind("ModelVariables/*[@name]"), strict=True):
        said = [part.get("relativeQuantity") for part in (element, *element)]
        of_type = variable.declaredType is not None and variable.declaredType.relativeQuantity
        variable.relativeQuantity = bool({"true", "1"} & set(said)) or bool(of_type and not any(said))
    for variable in description.modelVariables:
        if variable.alias is not None:
            variable.relativeQuantity = variable.alias.relativeQuantity


WARNING = 1  # status of FMI 2 and 3; messages of lower rank are not kept
KEPT = 5


class FmuMessages:
    """The last warnings and errors of one FMU; `callbacks` (FMI 2) and `listener` (FMI 3) must live as long as the FMU."""

    def __init__(self) -> None:
        self._messages: deque[str] = deque(maxlen=KEPT)
        self.listener: Callable[..., None] = lambda _, status, category, message: self.keep(status, message)
        self.callbacks = fmi2CallbackFunctions()
        self.callbacks.logger = _LOGGER
        self.callbacks.allocateMemory = fmi2CallbackAllocateMemoryTYPE(calloc)
        self.callbacks.freeMemory = fmi2CallbackFreeMemoryTYPE(free)
        self.callbacks.componentEnvironment = next(_ENVIRONMENTS)
        _LISTENING[self.callbacks.componentEnvironment] = self
        addLoggerProxy(byref(self.callbacks))

    def explain(self, failure: object) -> str:
        """Describe a failure on one line, followed by the FMU's messages since the last call."""
        said = "; ".join(self._messages)
        self._messages.clear()
        return f"{failure}: {said}" if said else str(failure)

    def keep(self, status: int, message: bytes | None) -> None:
        """Keep a message if its status is a warning or worse."""
        text = " ".join((message or b"").decode("utf-8", "replace").split())
        if status >= WARNING and text:
            self._messages.append(text)


def _log(environment: int | None, _name: bytes, status: int, _category: bytes, message: bytes) -> None:
    listener = _LISTENING.get(environment or 0)
    if listener is not None:
        listener.keep(status, message)


_ENVIRONMENTS = count(1)
_LISTENING: WeakValueDictionary[int, FmuMessages] = WeakValueDictionary()
_LOGGER = fmi2CallbackLoggerTYPE(_log)


NUMBERS = {"Real", "Integer", "Enumeration", "Boolean", "Float64", "Float32"} | {
    f"{sign}Int{bits}" for sign in ("", "U") for bits in (8, 16, 32, 64)
}
FLOATS = ("Real", "Float64", "Float32")
INTEGERS = {"Integer": (32, True)} | {  # bits, and whether one of them is a sign
    f"{'' if signed else 'U'}Int{bits}": (bits, signed) for bits in (8, 16, 32, 64) for signed in (True, False)
}


def grouped(description: ModelDescription) -> dict[str, list[ModelVariable]]:
    """Group the numeric inputs, outputs and parameters by name; an array of FMI 2 is the list of its elements in order.

    Two or more elements with consecutive indices form an array if they have one type and causality and no variable has the array's name.
    Each element remains a variable of its own as well.
    """
    offered = {
        variable.name: [variable]
        for variable in description.modelVariables
        if variable.causality in ("input", "output", "parameter")
        and variable.type in NUMBERS
        and math.prod(variable.shape)  # an array may be empty
    }
    elements: dict[str, dict[int, ModelVariable]] = {}
    for name, (variable,) in offered.items():
        match = ELEMENT.match(name)
        if match and not variable.shape:
            elements.setdefault(match["name"], {})[int(match["index"])] = variable
    arrays = {
        name: [by_index[index] for index in sorted(by_index)]
        for name, by_index in elements.items()
        if name not in offered and _are_array(by_index)
    }
    return offered | arrays


def _are_array(by_index: Mapping[int, ModelVariable]) -> bool:
    """Tell whether these elements, by their indices, form one array."""
    alike = len({(element.type, element.causality) for element in by_index.values()}) == 1
    return alike and len(by_index) > 1 and max(by_index) - min(by_index) + 1 == len(by_index)


def variables_of(
    description: ModelDescription, members: Mapping[str, list[ModelVariable]], said: Mapping[str, str]
) -> dict[str, Variable]:
    """Create the participant's variables from groups of the FMU's variables; `said` gives units that the FMU does not name.

    Raises ValueError for the unit of a variable that does not exist or has one in the FMU, and for a unit that is not known.
    """
    stated = {name: [_unit_name(member) for member in group] for name, group in members.items()}
    for name, unit in said.items():
        if name not in members:
            raise ValueError(f"unit of {name!r} is given, which is no variable, allowed: {', '.join(members)}")
        if any(stated[name]):
            raise ValueError(f"unit of {name!r} is given as {unit!r}, but the FMU itself says {stated[name][0]!r}")
        if read_unit(unit) is None:
            raise ValueError(
                f"unit of {name!r} is {unit!r}, which is not known, allowed: as in 'N', 'kN', 'm/s', 'kn', 'deg'"
            )
    defined = {unit.name: _defined(unit.baseUnit) for unit in description.unitDefinitions if unit.baseUnit is not None}
    return variable_table(
        _declare(name, group, [said.get(name) or unit or "1" for unit in stated[name]], defined)
        for name, group in members.items()
    )


def _declare(name: str, members: list[ModelVariable], unit_names: list[str], defined: Mapping[str, Unit]) -> Variable:
    """Create the variable that represents these members."""
    distinct = list(dict.fromkeys(unit_names))
    shape = tuple(members[0].shape) or (len(members),)
    units = {_unit(member, unit, defined) for member, unit in zip(members, unit_names, strict=True)}
    si = units.pop() if len(units) == 1 else None
    unit, causality = ", ".join(distinct).replace(".", " "), Causality(members[0].causality)
    return Variable(name, unit, shape, causality, si=si, numbers=_numbers(members[0].type))


def _numbers(kind: str) -> Numbers:
    """Which numbers a variable of this type holds; an enumeration's are whole."""
    return Numbers.REAL if kind in FLOATS else Numbers.BOOLEAN if kind == "Boolean" else Numbers.WHOLE


def _unit(member: ModelVariable, name: str, defined: Mapping[str, Unit]) -> Unit | None:
    """Return a unit's relation to SI, None if it is not known; a difference has no offset, so that one of 5 degC is 5 K."""
    unit = defined.get(name) or read_unit(name.replace(".", " "))
    return replace(unit, offset=0.0) if unit is not None and member.relativeQuantity else unit


def _unit_name(member: ModelVariable) -> str:
    """Return the unit that a variable or its type states; empty if neither does."""
    return member.unit or (member.declaredType.unit if member.declaredType is not None else None) or ""


def _defined(base: object) -> Unit:
    """Read a unit from its definition in the model description."""
    exponents = tuple(int(getattr(base, name)) for name in BASE)
    return Unit(exponents, float(base.factor), float(base.offset))  # type: ignore[attr-defined, arg-type]


def whole(variable: str, kind: str, numbers: Sequence[float]) -> list[int] | list[bool]:
    """Convert numbers to integers or booleans of the FMI type `kind`; ValueError for a number that is not whole or out of range."""
    bits, signed = INTEGERS.get(kind, (1, False))
    lowest, highest = (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if signed else (0, 2**bits - 1)
    for number in numbers:
        if not (lowest <= number <= highest and number == int(number)):
            allowed = "0 or 1" if kind == "Boolean" else f"whole numbers from {lowest} to {highest}"
            raise ValueError(f"{variable} is {number:g}, allowed: {allowed}")
    return [number != 0.0 for number in numbers] if kind == "Boolean" else [int(number) for number in numbers]
