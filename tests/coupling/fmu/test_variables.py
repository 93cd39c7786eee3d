"""What is read of an FMU's model description: arrays, units of differences, and descriptions that lack something."""

from __future__ import annotations

import re
import subprocess
import sys
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest

from coupling.fmu.fmu_participant import FmuParticipant
from coupling.master.co_simulation import CoSimulation
from coupling.master.connection import Connection, setup_problems

HEADS = {
    2: 'fmiVersion="2.0" modelName="M" guid="g"',
    3: 'fmiVersion="3.0" modelName="M" instantiationToken="g"',
}
CELSIUS = '<Unit name="degC"><BaseUnit K="1" offset="273.15"/></Unit>'

# y = 2 u, of as many elements as the structural parameter says
DOUBLING = """
import numpy as np
from pythonfmu3 import *
from pythonfmu3.variables import Dimension

class Doubling(Fmi3Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.n, self.time, self.u, self.y = 3, 0.0, np.zeros(3), np.zeros(3)
        structural = dict(causality=Fmi3Causality.structuralParameter, variability=Fmi3Variability.fixed)
        self.register_variable(UInt64("n", **structural))
        self.register_variable(Float64("time", causality=Fmi3Causality.independent, variability=Fmi3Variability.continuous))
        size = [Dimension(valueReference="0")]
        take = lambda value: setattr(self, "u", np.array(value))
        self.register_variable(Float64("u", dimensions=size, causality=Fmi3Causality.input, setter=take))
        self.register_variable(Float64("y", dimensions=size, causality=Fmi3Causality.output))

    def do_step(self, current_time, step_size):
        self.y = 2.0 * self.u
        return Fmi3StepResult(status=Fmi3Status.ok)
"""


def described(folder: Path, version: int, variables: str, *, before: str = "", head: str | None = None) -> Path:
    """A file with a model description and something in the place of a binary: an FMU as long as nobody runs it."""
    path = folder / "described.fmu"
    text = f"""<fmiModelDescription {HEADS[version] if head is None else head}><CoSimulation modelIdentifier="m"/>{before}
        <ModelVariables>{variables}</ModelVariables><ModelStructure/></fmiModelDescription>"""
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", text)
        ending = {"linux64": "so", "win64": "dll", "darwin64": "dylib"}[fmpy.platform]
        archive.writestr(f"binaries/{fmpy.platform}/m.{ending}", "")
    return path


def outputs(*names: str) -> str:
    return "".join(
        f'<ScalarVariable name="{name}" valueReference="{k}" causality="output"><Real/></ScalarVariable>'
        for k, name in enumerate(names)
    )


@pytest.mark.parametrize(
    ("names", "shapes"),
    [
        (["w[1]", "w[2]"], {"w[1]": (1,), "w[2]": (1,), "w": (2,)}),
        (["a[6]", "a[5]"], {"a[6]": (1,), "a[5]": (1,), "a": (2,)}),
        (["force", "force[1]"], {"force": (1,), "force[1]": (1,)}),
        (["force", "force[1]", "force[2]"], {"force": (1,), "force[1]": (1,), "force[2]": (1,)}),
        (["a[2]"], {"a[2]": (1,)}),
        (["a[1]", "a[3]"], {"a[1]": (1,), "a[3]": (1,)}),
    ],
)
def test_elements_have_their_own_names_and_arrays_are_made_of_several(
    tmp_path: Path, names: list[str], shapes: dict[str, tuple[int, ...]]
) -> None:
    variables = FmuParticipant("p", described(tmp_path, 2, outputs(*names))).variables
    assert {name: variable.shape for name, variable in variables.items()} == shapes


def test_arrays_are_as_long_as_a_structural_parameter_says(tmp_path: Path) -> None:
    script = tmp_path / "doubling_3.py"
    script.write_text(DOUBLING)
    command = [sys.executable, "-m", "pythonfmu3", "build", "-f", str(script), "-d", str(tmp_path)]
    subprocess.run(command, check=True, capture_output=True)
    bare, whole = tmp_path / "Doubling.fmu", tmp_path / "whole.fmu"
    with zipfile.ZipFile(bare) as built, zipfile.ZipFile(whole, "w") as copy:
        for item in built.namelist():  # pythonfmu3 (0.3) leaves out the parameter's value
            copy.writestr(item, built.read(item).replace(b'<UInt64 name="n"', b'<UInt64 name="n" start="3"'))
    with pytest.raises(ValueError, match="has no start value of a dimension of variable 'u'"):
        FmuParticipant("doubling", bare)
    fmu = FmuParticipant("doubling", whole)
    assert {name: variable.shape for name, variable in fmu.variables.items()} == {"u": (3,), "y": (3,)}
    run = CoSimulation([fmu], [], 0.1)
    run.initialize()
    fmu.set("u", np.array([1.0, 2.0, 3.0]))
    run.step()
    np.testing.assert_array_equal(run.outputs("doubling")["y"], [2.0, 4.0, 6.0])
    run.terminate()


@pytest.mark.parametrize(
    ("version", "types", "variable", "offset"),
    [
        (2, "", '<Real start="0" unit="degC"/>', 273.15),
        (2, "", '<Real start="0" unit="degC" relativeQuantity="true"/>', 0.0),
        (2, '<SimpleType name="D"><Real unit="degC" relativeQuantity="true"/></SimpleType>', '<Real start="0" declaredType="D"/>', 0.0),
        (
            2,
            '<SimpleType name="D"><Real unit="degC" relativeQuantity="true"/></SimpleType>',
            '<Real start="0" declaredType="D" relativeQuantity="false"/>',
            273.15,
        ),
        (3, "", 'start="0" unit="degC" relativeQuantity="true"', 0.0),
        (3, '<Float64Type name="D" unit="degC" relativeQuantity="true"/>', 'start="0" declaredType="D"', 0.0),
        (3, '<Float64Type name="D" unit="degC"/>', 'start="0" declaredType="D"', 273.15),
    ],
)  # fmt: skip
def test_differences_have_no_offset(tmp_path: Path, version: int, types: str, variable: str, offset: float) -> None:
    """5 degC of temperature are 278.15 K, 5 degC of a difference are 5 K."""
    before = f"<UnitDefinitions>{CELSIUS}</UnitDefinitions><TypeDefinitions>{types}</TypeDefinitions>"
    stated = {2: f'<ScalarVariable name="T" valueReference="1" causality="input">{variable}</ScalarVariable>'} | {
        3: f'<Float64 name="T" valueReference="1" causality="input" {variable}/>'
    }
    fmu = FmuParticipant("p", described(tmp_path, version, stated[version], before=before))
    unit = fmu.variables["T"].known_unit
    assert unit is not None
    assert (unit.factor, unit.offset) == (1.0, offset)


@pytest.mark.parametrize(
    ("variables", "head", "told"),
    [
        ('<Float64 name="x" causality="output"/>', None, "has no valueReference for variable 'x', allowed: a whole number"),
        ('<Float64 name="x" valueReference="abc"/>', None, "has valueReference 'abc' for variable 'x', allowed: a whole number"),
        ("", 'modelName="M"', "has no fmiVersion, allowed: 2.0 or 3.0"),
        ("", 'fmiVersion="1.0"', "has fmiVersion '1.0', allowed: 2.0 or 3.0"),
    ],
)  # fmt: skip
def test_what_a_description_lacks_is_named(tmp_path: Path, variables: str, head: str | None, told: str) -> None:
    with pytest.raises(ValueError, match=f"described.fmu cannot be read: modelDescription.xml {told}$"):
        FmuParticipant("p", described(tmp_path, 3, variables, head=head))


@pytest.mark.parametrize(
    ("version", "variable", "entry", "told"),
    [
        (2, '<ScalarVariable name="y" valueReference="7"><Real/></ScalarVariable>', '<Outputs><Unknown index="2"/></Outputs>', "index '2'"),
        (3, '<Float64 name="y" valueReference="7"/>', '<Output valueReference="14"/>', "valueReference '14'"),
    ],
)  # fmt: skip
def test_outputs_of_no_variable_are_named(tmp_path: Path, version: int, variable: str, entry: str, told: str) -> None:
    variables = f"{variable}</ModelVariables><ModelStructure>{entry}</ModelStructure><ModelVariables>"
    with pytest.raises(ValueError, match=f"cannot be read: modelDescription.xml has {told} of no variable"):
        FmuParticipant("p", described(tmp_path, version, variables))


def inputs(*names: str) -> str:
    return outputs(*names).replace("output", "input").replace("<Real/>", '<Real start="0"/>')


@pytest.mark.parametrize(
    ("variables", "fed", "problems"),
    [
        (["w[1]", "w[2]"], ["w", "w[2]"], ["the input b:w[2] is fed, and so is the array b:w, allowed: one of them"]),
        (["w[1]", "w[2]"], ["w[1]", "w[2]"], []),
        (["force", "force[1]", "force[2]"], ["force", "force[1]"], []),
    ],
)
def test_an_array_and_its_element_are_not_fed_both(
    tmp_path: Path, variables: list[str], fed: list[str], problems: list[str]
) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    source = FmuParticipant("a", described(tmp_path / "a", 2, outputs(*variables)))
    target = FmuParticipant("b", described(tmp_path / "b", 2, inputs(*variables)))
    assert setup_problems([source, target], [Connection("a", name, "b", name) for name in fed]) == problems


@pytest.mark.parametrize("value", [[1.0, 2.0, 3.0], [1.0], [[1.0, 2.0]]])
def test_start_values_of_an_array_have_its_shape(tmp_path: Path, value: list[float]) -> None:
    """Too many are not cut, and too few are not repeated."""
    path = described(tmp_path, 2, inputs("w[1]", "w[2]"))
    told = re.escape(f"'p': variable 'w' has shape {np.shape(value)}, allowed: (2,)")
    with pytest.raises(ValueError, match=told):
        FmuParticipant("p", path, {"w": value})
    FmuParticipant("p", path, {"w": [1.0, 2.0]})
    FmuParticipant("p", path, {"w": 1.0})


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_start_values_are_finite(tmp_path: Path, value: float) -> None:
    variable = '<Float64 name="T" valueReference="1" causality="input" start="0"/>'
    with pytest.raises(ValueError, match=f"'p': 'T' is {value}, allowed: finite numbers"):
        FmuParticipant("p", described(tmp_path, 3, variable), {"T": value})
