"""What the standard allows and few FMUs do: further names, one step size to the last bit, whole numbers and booleans."""

from __future__ import annotations

import subprocess
import zipfile
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from coupling.fmu.fmu_participant import FmuParticipant
from coupling.master.co_simulation import CoSimulation
from coupling.master.connection import Connection
from coupling.master.errors import CouplingSetupError
from recordings.files.writing import module_command, module_environment

# gives what it is given; fails when a step is not of the first one's size to the last bit
STRICT = """
from pythonfmu import Fmi2Causality, Fmi2Slave, Real, Integer, Boolean

class Strict(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.real, self.whole, self.flag, self.time, self.first = 0.0, 0, False, 0.0, None
        self.real_in, self.whole_in, self.flag_in = 0.0, 0, False
        for kind, name in ((Real, "real"), (Integer, "whole"), (Boolean, "flag")):
            self.register_variable(kind(name, causality=Fmi2Causality.output))
            self.register_variable(kind(name + "_in", causality=Fmi2Causality.input))

    def do_step(self, current_time, step_size):
        self.first = self.first or step_size
        if step_size != self.first:
            raise RuntimeError(f"step of {step_size!r} s after {self.first!r} s")
        self.real += step_size
        return True
"""
# a speed, with two more names
THREE = """
from pythonfmu3 import Fmi3Slave, Fmi3Causality, Fmi3Variability, Float64, Fmi3StepResult, Fmi3Status

class Echo(Fmi3Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.time, self.given, self.told = 0.0, 0.0, 0.0
        self.register_variable(Float64("time", causality=Fmi3Causality.independent, variability=Fmi3Variability.continuous))
        self.register_variable(Float64("given", causality=Fmi3Causality.input))
        self.register_variable(Float64("told", causality=Fmi3Causality.output))

    def do_step(self, current_time, step_size):
        self.told = 2.0 * self.given
        return Fmi3StepResult(status=Fmi3Status.ok)
"""


def built(package: str, source: str, folder: Path, *options: str) -> Path:
    folder.mkdir(exist_ok=True)
    script = folder / f"{package}_{folder.name}.py"
    script.write_text(source)
    command = module_command(package, "build", "-f", str(script), "-d", str(folder), *options)
    subprocess.run(command, check=True, capture_output=True, env=module_environment())
    return next(folder.glob("*.fmu"))


def with_description(fmu: Path, target: Path, change: Callable[[ElementTree.Element], None]) -> Path:
    """A copy of an FMU with its description changed."""
    with zipfile.ZipFile(fmu) as source, zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as copy:
        for item in source.namelist():
            data = source.read(item)
            if item == "modelDescription.xml":
                root = ElementTree.fromstring(data)
                change(root)
                data = ElementTree.tostring(root)
            copy.writestr(item, data)
    return target


@pytest.fixture(scope="module")
def strict(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return built("pythonfmu", STRICT, tmp_path_factory.mktemp("strict"), "--no-variable-step")


@pytest.fixture(scope="module")
def echo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return built("pythonfmu3", THREE, tmp_path_factory.mktemp("echo"))


def named(*names: tuple[str, str | None]) -> Callable[[ElementTree.Element], None]:
    """Adds further names to variables."""

    def change(root: ElementTree.Element) -> None:
        for variable, name in names:
            element = next(one for one in root.iterfind("ModelVariables/*") if one.get("name") == variable)
            ElementTree.SubElement(element, "Alias", {} if name is None else {"name": name})

    return change


@pytest.mark.parametrize(("start", "sub_rate"), [(0.0, 1), (0.0, 3), (1.1, 1), (1e4, 1)])
def test_an_fmu_of_one_step_size_is_given_one_number(strict: Path, start: float, sub_rate: int) -> None:
    """Differences of times that are no doubles have other last bits in every second step."""
    fmu = FmuParticipant("strict", strict)
    run = CoSimulation([fmu], [], 0.01, start_time=start, sub_rates={"strict": sub_rate})
    run.initialize()
    run.run(start + 1.0)
    assert fmu.get("real")[0] == pytest.approx(1.0)
    run.terminate()


def test_aliases_are_names_like_others(echo: Path, tmp_path: Path) -> None:
    names = [("told", "again"), ("told", "once more"), ("given", "input[1]")]
    fmu = FmuParticipant("echo", with_description(echo, tmp_path / "aliased.fmu", named(*names)), {"input[1]": 2.0})
    assert fmu.other_names == {"again": "told", "once more": "told", "input[1]": "given"}
    run = CoSimulation([fmu], [], 0.1)
    run.initialize()
    run.step()
    assert [float(fmu.get(name)[0]) for name in ("told", "again", "once more")] == [4.0, 4.0, 4.0]
    fmu.set("input[1]", np.array([5.0]))
    assert fmu.get("given")[0] == 5.0
    run.terminate()


@pytest.mark.parametrize(
    ("name", "told"),
    [("given", "has 2 variables of the name 'given', allowed: one"), (None, "has an Alias without a name")],
)
def test_aliases_that_name_nothing_of_their_own_are_refused(
    echo: Path, tmp_path: Path, name: str | None, told: str
) -> None:
    path = with_description(echo, tmp_path / "twice.fmu", named(("told", name)))
    with pytest.raises(ValueError, match=told):
        FmuParticipant("echo", path)


@pytest.mark.parametrize(
    ("source", "target", "told"),
    [
        ("real", "whole_in", "real numbers feed whole ones, allowed: whole or boolean"),
        ("real", "flag_in", "real numbers feed boolean ones, allowed: boolean"),
        ("whole", "flag_in", "whole numbers feed boolean ones, allowed: boolean"),
        ("whole", "real_in", ""),
        ("flag", "real_in", ""),
        ("flag", "whole_in", ""),
    ],
)
def test_kinds_of_numbers_that_cannot_fit_are_told_before_a_run(
    strict: Path, source: str, target: str, told: str
) -> None:
    fmus = [FmuParticipant(name, strict) for name in ("first", "second")]
    connection = Connection("first", source, "second", target)
    if told:
        with pytest.raises(CouplingSetupError, match=told):
            CoSimulation(fmus, [connection], 0.01)
    else:
        CoSimulation(fmus, [connection], 0.01)
