"""Reads the model description of an FMU by FMPy, adds the parts that FMPy leaves out, and checks that the FMU can run here."""

from __future__ import annotations

import shutil
import tempfile
import zipfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path, PurePosixPath
from xml.etree import ElementTree

import fmpy
from fmpy.model_description import ModelDescription, read_model_description

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
