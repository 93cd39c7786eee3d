"""Builds FMUs for co-simulation, FMI 2 or 3, out of participants.

The FMU holds the slave's script, `pythonfmu` or `pythonfmu3`, and the files of its `FmuContent`. Its host needs a Python in which oilsim is
installed. The slave is written in Python and not in C, because the exported models are Python, and their FMU embeds the interpreter in any
case. So the build needs no compiler, and small models and whole exercises are built in the same way.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import uuid
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import metadata
from keyword import iskeyword
from pathlib import Path
from typing import Literal

import fmpy
from fmpy.validation import validate_fmu

from coupling.fmu.trial_process import temporary_folder
from recordings.files.writing import module_command, module_environment

Version = Literal[2, 3]

PACKAGES = {2: "pythonfmu", 3: "pythonfmu3"}
SCRIPT = '''"""The slave of this FMU; written by oilsim."""

from {package} import DefaultExperiment, Fmi{version}Slave

try:
    from coupling.fmu.participant_slave import Slave{version}
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
    """Content of an FMU.

    identifier: name of the model, a Python name in ASCII; ValueError for another. factory: ``package.module:callable`` that makes the
    participant from the folder of its files (see `coupling.fmu.participant_slave.ParticipantSlave`). description: one line. texts, files:
    the texts of files in that folder and the files to be copied to it, by name. stop_time, step_size [s]: of the proposed experiment.
    any_step: true if it takes steps of any size. saves_state: true if its state can be saved, restored and serialised.
    """

    identifier: str
    factory: str
    description: str
    step_size: float
    stop_time: float
    any_step: bool = False
    saves_state: bool = True
    texts: Mapping[str, str] = field(default_factory=dict)
    files: Mapping[str, Path] = field(default_factory=dict)

    def __post_init__(self) -> None:
        name = self.identifier  # of C functions too
        if not (name.isascii() and name.isidentifier()) or iskeyword(name):
            raise ValueError(f"identifier of an FMU is {name!r}, allowed: letters a to z, digits and '_', no keyword")


def export_fmu(content: FmuContent, path: str | Path, version: Version) -> None:
    """Write an FMU for FMI `version`; FmuExportError if pythonfmu or its binary for this platform is missing, or the FMU is not valid."""
    package = PACKAGES[version]
    try:
        metadata.version(package)
    except metadata.PackageNotFoundError as cause:
        text = f"{package} is not installed, needed for FMI {version}: pip install 'oilsim[fmu]'"
        raise FmuExportError(text) from cause
    with temporary_folder("fmu") as folder:
        built = _build(content, version, Path(folder))
        problems = validate_fmu(str(built))
        if problems:
            raise FmuExportError(f"the FMU of {content.identifier} is not sound: {'; '.join(problems)}")
        if fmpy.platform not in fmpy.supported_platforms(str(built)):
            raise FmuExportError(f"{package} has no binary for {fmpy.platform}, allowed: Linux and Windows on x86-64")
        shutil.move(built, path)


def _build(content: FmuContent, version: Version, folder: Path) -> Path:
    """Build the FMU in `folder`, in a separate process: a process that has run FMUs may hold their copies of pythonfmu."""
    script, files = _script(content, version, folder), _files(content, folder / "files")
    state = ["--handle-state", "--serialize-state"] if content.saves_state else []
    options = [*state, *([] if content.any_step else ["--no-variable-step"])]
    target = folder / "built"
    command = module_command(
        PACKAGES[version], "build", "-f", str(script), "-d", str(target), *options, *map(str, files)
    )
    environment = module_environment(_own_module_path())
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    if done.returncode != 0:
        said = (done.stderr.strip() or "nothing").splitlines()[-1]
        raise FmuExportError(f"{PACKAGES[version]} cannot build the FMU of {content.identifier}: {said}")
    return next(target.glob("*.fmu"))


def _own_module_path() -> list[str]:
    """Return the module path without the folders that FMUs of this process have put on it."""
    return [place for place in sys.path if Path(place).exists() and not (Path(place) / "slavemodule.txt").exists()]


def _script(content: FmuContent, version: Version, folder: Path) -> Path:
    """Write the slave's script, under a new name for each build, because a process keeps only one module of a name."""
    script = folder / f"oilsim_fmu_{uuid.uuid4().hex}.py"
    text = SCRIPT.format(
        package=PACKAGES[version],
        version=version,
        identifier=content.identifier,
        factory=content.factory,
        experiment=(0.0, content.stop_time, content.step_size),
        description=content.description,
    )
    script.write_text(text, encoding="utf-8")
    return script


def _files(content: FmuContent, folder: Path) -> list[Path]:
    """Write the files of the participant's folder into `folder`, and list them."""
    folder.mkdir()
    for name, text in content.texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    for name, source in content.files.items():
        shutil.copyfile(source, folder / name)
    return sorted(folder.iterdir())
