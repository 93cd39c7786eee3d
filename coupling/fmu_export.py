"""Builds FMUs for co-simulation, FMI 2 or 3, out of participants.

The FMU holds the slave's script, `pythonfmu` or `pythonfmu3`, and the files it is given; it needs a Python on its host in which
oilsim is installed. Python, and not C, because what is exported is Python all through and an FMU of it embeds the interpreter in
any case; so no compiler is needed, and small models and whole exercises are built by one means.
"""

from __future__ import annotations

import importlib.util
import shutil
import sys
import tempfile
import uuid
from collections.abc import Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from fmpy.validation import validate_fmu

Version = Literal[2, 3]

PACKAGES = {2: "pythonfmu", 3: "pythonfmu3"}
SCRIPT = '''"""The slave of this FMU; written by oilsim."""

from {package} import DefaultExperiment, Fmi{version}Slave

try:
    from coupling.fmu_slave import Slave{version}
except ImportError as cause:
    raise ImportError("this FMU needs oilsim in the Python of its host: pip install oilsim") from cause


class {identifier}(Slave{version}, Fmi{version}Slave):
    factory = "{factory}"
    experiment = {experiment}

    def __init__(self, **keywords):
        super().__init__(**keywords)
        self.description = {description!r}
        self.default_experiment = DefaultExperiment(*self.experiment)
'''


class FmuExportError(RuntimeError):
    """An FMU cannot be built."""


@dataclass(frozen=True, kw_only=True)
class FmuContent:
    """What becomes an FMU.

    identifier: of the model, a Python name; factory: ``package.module:callable`` that makes the participant from the folder of its
    files (see `coupling.fmu_slave.ParticipantSlave`); description: one line; texts and files: what that folder holds, by name;
    stop_time, step_size [s]: of the proposed experiment; any_step: whether it takes steps of any size.
    """

    identifier: str
    factory: str
    description: str
    step_size: float
    stop_time: float
    any_step: bool = False
    texts: Mapping[str, str] = field(default_factory=dict)
    files: Mapping[str, Path] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not self.identifier.isidentifier():
            raise ValueError(f"identifier of an FMU is {self.identifier!r}, allowed: letters, digits and '_'")


def export_fmu(content: FmuContent, path: str | Path, version: Version) -> None:
    """Write the FMU; FmuExportError if pythonfmu or its binary is missing or the result is not sound."""
    target = Path(path)
    builder = _builder(version)
    with tempfile.TemporaryDirectory(prefix="oilsim-fmu-") as folder:
        built = _build(content, builder, version, Path(folder))
        problems = validate_fmu(str(built))
        if problems:
            raise FmuExportError(f"the FMU of {content.identifier} is not sound: {'; '.join(problems)}")
        shutil.move(built, target)


def _builder(version: Version):  # type: ignore[no-untyped-def]
    """The FmuBuilder of the package for this version of FMI."""
    package = PACKAGES[version]
    if importlib.util.find_spec(package) is None:
        raise FmuExportError(f"{package} is not installed, needed for FMI {version}: pip install 'oilsim[fmu]'")
    builder = importlib.import_module(f"{package}.builder").FmuBuilder
    if not builder.has_binary():
        raise FmuExportError(f"{package} has no binary for {sys.platform}, allowed: Linux and Windows on x86-64")
    return builder


def _build(content: FmuContent, builder, version: Version, folder: Path) -> Path:  # type: ignore[no-untyped-def]
    """The FMU in `folder`.

    A process keeps one module of a name, and the FMU's binary imports its script by name: so each build gets a name of its own.
    """
    module = f"oilsim_fmu_{uuid.uuid4().hex}"
    script = folder / f"{module}.py"
    script.write_text(
        SCRIPT.format(
            package=PACKAGES[version],
            version=version,
            identifier=content.identifier,
            factory=content.factory,
            experiment=(0.0, content.stop_time, content.step_size),
            description=content.description,
        ),
        encoding="utf-8",
    )
    files = folder / "files"
    files.mkdir()
    for name, text in content.texts.items():
        (files / name).write_text(text, encoding="utf-8")
    for name, source in content.files.items():
        shutil.copyfile(source, files / name)
    state = "canGetAndSetFMUstate" if version == 2 else "canGetAndSetFMUState"
    serialized = "canSerializeFMUstate" if version == 2 else "canSerializeFMUState"
    options = {state: True, serialized: True, "canHandleVariableCommunicationStepSize": content.any_step}
    with _module_path_kept():
        built: Path = builder.build_FMU(script, folder / "built", sorted(files.iterdir()), **options)
    return built


@contextmanager
def _module_path_kept():  # type: ignore[no-untyped-def]
    """pythonfmu leaves the script's folder on the module path."""
    before = list(sys.path)
    try:
        yield
    finally:
        sys.path[:] = before
