"""Scenes and files of any size and depth are told in words before anything is taken for them."""

from __future__ import annotations

import tracemalloc
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from coupling.fmu.variables import FILE, read_description
from scenarios.cli import main
from scenarios.schema.liquid import BlockFill, CylinderFill, Tank
from scenarios.setup import cost, layout
from scenarios.setup.fill_lattice import Lattice, region_points
from scenarios.spec.load import load_scenario
from scenarios.text.problems import ScenarioError

SPACING = 0.1


@pytest.mark.parametrize("base", [(1.0, 1.1, 0.6), (0.1, 1.1, 1.4)])
def test_a_small_region_of_a_large_tank_takes_its_own_memory(base: tuple[float, float, float]) -> None:
    """The same points as picked from the whole tank, from which a ball in 150 m took 25 GiB."""
    fill = CylinderFill(phase="water", base=base, radius=0.33, height=0.6)
    small = Tank(lower=(0.0, 0.0, 0.0), upper=(2.0, 2.0, 2.0))
    everything = Lattice(small, SPACING, 3).box(small.lower, small.upper)
    points = region_points(fill, small, SPACING, 3)
    assert {tuple(point) for point in points} <= {tuple(point) for point in everything}
    tracemalloc.start()
    again = region_points(fill, Tank(lower=(0.0, 0.0, 0.0), upper=(150.0, 150.0, 150.0)), SPACING, 3)
    assert tracemalloc.get_traced_memory()[1] < 10e6
    tracemalloc.stop()
    assert len(again) >= len(points) > 50


def test_a_cylinder_holds_every_point_of_the_lattice_within_it() -> None:
    tank = Tank(lower=(0.0, 0.0, 0.0), upper=(2.0, 2.0, 2.0))
    fill = CylinderFill(phase="water", base=(1.0, 1.1, 0.9), radius=0.33, height=0.4)
    everything = Lattice(tank, SPACING, 3).box((0.0, 0.0, 0.9), (2.0, 2.0, 1.3))
    expected = everything[np.linalg.norm(everything[:, :2] - fill.base[:2], axis=1) <= fill.radius]
    np.testing.assert_array_equal(region_points(fill, tank, SPACING, 3), expected)


def test_a_plane_scene_does_not_care_how_deep_its_tank_is_across_the_plane() -> None:
    fill = BlockFill(phase="water", lower=(0.0, -1e9, 0.0), upper=(1.0, 1e9, 1.0))
    inset = replace(fill, inset=0.5)
    deep = Tank(lower=(0.0, -1e9, 0.0), upper=(1.0, 1e9, 2.0))
    for each, count in ((fill, 100), (inset, 81)):
        points = region_points(each, deep, SPACING, 2)
        assert len(points) == count
        assert (points[:, 1] == 0.0).all()


@pytest.mark.parametrize("entry", ["tank.upper.1=1e9", "tank.lower.1=-1e300"])
def test_a_plane_scenario_with_a_tank_of_any_depth_is_checked(entry: str) -> None:
    assert main(["check", "drop-in-air", "--set", entry]) in (0, 2)


@pytest.mark.parametrize("length", ["1e6", "2147483648"])
def test_hulls_longer_than_any_ship_are_refused(length: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "u-sweep", "--set", f"vessels.starboard.length={length}"]) == 2
    assert "at most 1000 m" in capsys.readouterr().err


def test_a_body_too_large_to_sample_is_refused_and_not_looked_for_in_the_liquid(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """It would cross a tank that repeats a hundred thousand times."""
    looked_for = layout.clear_of

    def small_only(solids, *others):
        found = list(solids)
        assert not found
        return looked_for(found, *others)

    monkeypatch.setattr(layout, "clear_of", small_only)
    assert main(["check", "floating-box", "--set", "bodies.box.size=[1e6, 1e6, 1.0]"]) == 2
    assert "cannot be sampled" in capsys.readouterr().err


@pytest.mark.parametrize("command", ["check", "run"])
def test_a_scene_that_memory_cannot_hold_is_refused(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(cost, "memory_there", lambda: 1e9)
    assert main([command, "still-column", "--set", "fluid.particle_spacing=0.005"]) == 2
    assert "GB at fluid.particle_spacing = 0.005 m, allowed: a larger spacing" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("entry", ["x = " + "[" * 5000 + "]" * 5000, "x = 1" + "0" * 5000, "x = " + '{"a" = ' * 3000])
def test_toml_of_any_depth_and_numbers_of_any_length_are_refused(entry: str, tmp_path: Path) -> None:
    (tmp_path / "odd.toml").write_text(entry)
    with pytest.raises(ScenarioError, match="cannot be read"):
        load_scenario(tmp_path / "odd.toml")
    for value in ("[" * 4000, "1" + "0" * 5000):
        with pytest.raises(ScenarioError):
            load_scenario("still-column", overrides=[f"fluid.particle_spacing={value}"])


def test_fmus_that_unpack_to_more_than_there_is_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "bomb.fmu"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive, archive.open(FILE, "w") as entry:
        for _ in range(300):
            entry.write(b" " * 1_000_000)
    with pytest.raises(ValueError, match="has 300 MB, allowed: up to 256 MB"):
        read_description(path)


@pytest.mark.parametrize(("name", "told"), [("n" * 256, "allowed: up to 255 bytes"), ("../../evil", "leads out of it")])
def test_names_that_no_folder_takes_are_refused(name: str, told: str, tmp_path: Path) -> None:
    path = tmp_path / "odd.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(FILE, "<fmiModelDescription/>")
        archive.writestr(f"resources/{name}", "")
    with pytest.raises(ValueError, match=told):
        read_description(path)


@pytest.mark.parametrize("entry", ["sea.depth=1e-323", "shore.slope=1e-300"])
def test_a_shore_without_depth_or_slope_is_refused_in_words(entry: str) -> None:
    assert main(["check", "shore-seal", "--set", entry]) == 2
