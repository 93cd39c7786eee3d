"""Bodies from mesh files in a scenario: mass, liquid left out and walls follow from one reading, and `check` tells what `run` tells."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest
import trimesh

from coupling.solids.bodies import box
from coupling.solids.solid_mesh import read_solid
from scenarios.cli import main
from scenarios.running.assembly import build
from scenarios.setup.cost import estimate
from scenarios.setup.layout import lay_out
from scenarios.spec.load import scenario_from
from scenarios.spec.resolve import resolve
from scenarios.spec.scenario import Scenario

TANK = """
name = "mesh"
[run]
duration = 0.02
threads = 1
[fluid]
particle_spacing = 0.05
[phases.water]
density = 1000.0
dynamic_viscosity = 1.0e-3
[tank]
lower = [0.0, 0.0, 0.0]
upper = [1.4, 1.0, 1.0]
open = ["+z"]
[fill.pool]
shape = "slab"
phase = "water"
bottom = 0.0
top = 0.6
"""
PLACE = (0.6, 0.5, 0.35)


def inwards(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.vertices, mesh.faces[:, ::-1], process=False)


def hull(folder: Path, *parts: trimesh.Trimesh) -> str:
    """A body's table, of a mesh file of these parts."""
    trimesh.util.concatenate(list(parts)).export(folder / "hull.stl")
    return (
        f'[bodies.hull]\nshape = "mesh"\nfile = "{folder / "hull.stl"}"\ndensity = 500.0\nposition = {list(PLACE)}\n'
        'motion = "fixed"\n'
    )


def scenario_of(extra: str) -> Scenario:
    return scenario_from(tomllib.loads(TANK + extra))


def liquid_in(solid: trimesh.Trimesh, scenario: Scenario) -> int:
    """Particles that lie in a solid at the start."""
    points = np.concatenate(list(lay_out(resolve(scenario)).positions.values())) - PLACE
    return int(read_solid(solid).contains(points).sum())


def test_parts_that_overlap_are_one_solid_for_mass_walls_and_liquid(tmp_path: Path) -> None:
    parts = box((0.4, 0.4, 0.4)), box((0.4, 0.4, 0.4)).apply_translation((0.2, 0, 0))
    scenario = scenario_of(hull(tmp_path, *parts))
    (solid,) = lay_out(resolve(scenario)).solids
    assert solid.placed.mass_properties.mass == pytest.approx(500.0 * 0.096, rel=1e-5)
    assert liquid_in(box((0.6, 0.4, 0.4)).apply_translation((0.1, 0, 0)), scenario) == 0
    (told,) = estimate(scenario).told
    assert told.startswith("bodies.hull.file '") and "2 parts that overlap or touch joined to one solid" in told
    assert told in [remark.text for remark in build(scenario).remarks.look(None)]


def test_a_part_wound_inwards_is_mended_and_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    parts = box((0.3, 0.3, 0.3)), inwards(box((0.2, 0.2, 0.2)).apply_translation((0.4, 0, 0)))
    scenario = scenario_of(hull(tmp_path, *parts))
    (solid,) = lay_out(resolve(scenario)).solids
    assert solid.placed.mass_properties.mass == pytest.approx(500.0 * (0.027 + 0.008), rel=1e-5)
    (tmp_path / "mesh.toml").write_text(TANK + hull(tmp_path, *parts))
    assert main(["check", str(tmp_path / "mesh.toml")]) == 0
    assert "1 part wound inwards turned outwards, about (0.4, 0, 0) m" in " ".join(capsys.readouterr().out.split())


def test_a_sealed_hollow_stays_dry(tmp_path: Path) -> None:
    shell, room = box((0.6, 0.6, 0.5)), box((0.4, 0.4, 0.3))
    table = hull(tmp_path, shell, inwards(room))
    scenario = scenario_of(table)
    assert liquid_in(shell, scenario) == 0
    (solid,) = lay_out(resolve(scenario)).solids
    assert solid.placed.mass_properties.mass == pytest.approx(500.0 * (0.18 - 0.048), rel=1e-5)
    assert solid.placed.mesh.volume == pytest.approx(0.18, rel=1e-5)  # it displaces its outside
    (told,) = estimate(scenario).told
    assert "0.048 m3 of sealed hollow stay dry and hold no mass" in told


def test_check_tells_of_thin_plates_as_run_does() -> None:
    gate = '[bodies.gate]\nshape = "box"\nsize = [{}, 1.2, 0.9]\nposition = [0.7, 0.5, 0.45]\nmotion = "fixed"\n'
    thin = scenario_of(gate.format(0.05))
    swollen, told = estimate(thin).told
    assert told.startswith("gate has plates 0.05") and "1 particle spacings: it does not move by the liquid" in told
    assert "meets these plates as 0.065 m thick, so that nothing leaks" in told
    assert {swollen, told} <= {remark.text for remark in build(thin).remarks.look(None)}
    thinner = estimate(scenario_of(gate.format(0.02))).told
    assert [text.split(":")[0] for text in thinner] == [
        "gate has parts thinner than 1.3 particle spacings",
        "gate has plates 0.02 m thin, 0.4 particle spacings",
    ]
    assert estimate(scenario_of(gate.format(0.065))).told == ()


@pytest.mark.parametrize("entry", ["", "hull = true\n"])
def test_a_mesh_is_a_hull_only_if_it_says_so(tmp_path: Path, entry: str) -> None:
    """A box of 0.6 x 0.2 x 0.2 m, half afloat in 1 m/s along it: by its face C_n A rho / 2 = 12 N; of a hull, friction below 2 N."""
    table = hull(tmp_path, box((0.6, 0.2, 0.2))).replace('motion = "fixed"\n', entry).replace("0.35]", "0.6]")
    sea = '[sea]\ndepth = 10.0\nlevel = 0.6\n[sea.current]\nkind = "steady"\nspeed = 1.0\n'
    world = build(scenario_from(tomllib.loads('fidelity = "none"\n' + TANK + sea + table))).world
    assert world is not None and world.environment is not None
    force = world.environment.loads(0.0, world.poses(["hull"]), np.zeros((1, 6))).wrench[0, 0]
    world.close()
    if entry:
        assert 0.0 < force < 2.0
    else:
        assert force == pytest.approx(0.5 * 1000.0 * 1.17 * 0.02, rel=0.1)
