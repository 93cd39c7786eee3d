"""Where liquid starts: the counts of the paper, regions that fit together, and scenes that survive another spacing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from oilsim import Fluid, FluidConfig, Phase, block, tank_walls
from scenarios.schema.liquid import BlockFill, CylinderFill, SlabFill, Tank
from scenarios.setup.cost import estimate
from scenarios.setup.fill_lattice import off_lattice, region_points, starting_positions
from scenarios.setup.layout import lay_out
from scenarios.setup.simulators import build_simulators
from scenarios.spec.load import library_paths, load_scenario
from scenarios.spec.resolve import resolve
from scenarios.text.problems import ScenarioError

WITHOUT_PARTICLES = {name for name, path in library_paths().items() if "[tank]" not in path.read_text(encoding="utf-8")}
MILLIMETRES = {"rock-coating", "drop-in-air"}  # scenes that such spacings leave nothing of
TANK = Tank(lower=(0.0, 0.0, 0.0), upper=(1.0, 1.0, 1.0))


def test_calm_spread_has_the_papers_particles() -> None:
    """132 x 66 x 9 = 78,408 of ocean and 16 x 32 x 16 = 8,192 of oil, at a particle radius of 0.015 m."""
    scenario = load_scenario("calm-spread").scenario
    positions = starting_positions(scenario.fill, scenario.tank, scenario.fluid.particle_spacing, 3)
    counts = {name: tuple(len(np.unique(axis.round(9))) for axis in points.T) for name, points in positions.items()}
    assert counts == {"ocean": (132, 66, 9), "oil": (16, 16, 32)}
    assert len(positions["ocean"]) == 78_408
    assert len(positions["oil"]) == 8_192


@pytest.mark.parametrize("spacing", [0.03, 0.07, 0.1, 0.21])
def test_layers_touch_without_gap_or_overlap_at_any_spacing(spacing: float) -> None:
    """Two slabs that share a face stay one spacing apart, whatever the spacing."""
    fills = {
        "water": SlabFill(phase="water", bottom=0.0, top=0.31),
        "oil": SlabFill(phase="oil", bottom=0.31, top=0.5),
    }
    positions = starting_positions(fills, TANK, spacing, 3)
    gap = positions["oil"][:, 2].min() - positions["water"][:, 2].max()
    assert gap == pytest.approx(spacing, rel=1e-9)


def test_later_region_replaces_earlier_ones() -> None:
    """A drum of oil inside the water: together they hold what the water alone held, each point once."""
    water = SlabFill(phase="water", bottom=0.0, top=1.0)
    drum = CylinderFill(phase="oil", base=(0.5, 0.5, 0.2), radius=0.3, height=0.5)
    positions = starting_positions({"water": water, "drum": drum}, TANK, 0.05, 3)
    everything = np.concatenate(list(positions.values()))
    assert len(everything) == 20**3
    distance, _ = cKDTree(everything).query(everything, k=2)
    assert distance[:, 1].min() == pytest.approx(0.05, rel=1e-9)


def test_volume_of_a_round_region() -> None:
    """Particles times d^3 approach pi r^2 h; a lattice counts a smooth body to a few percent."""
    d = 0.02
    cylinder = CylinderFill(phase="oil", base=(0.5, 0.5, 0.2), radius=0.3, height=0.4)
    assert len(region_points(cylinder, TANK, d, 3)) * d**3 == pytest.approx(np.pi * 0.3**2 * 0.4, rel=0.02)


def test_thin_region_keeps_one_layer_and_an_empty_one_is_refused() -> None:
    thin = CylinderFill(phase="oil", base=(0.5, 0.5, 0.5), radius=0.3, height=0.01)
    assert len(np.unique(region_points(thin, TANK, 0.1, 3)[:, 2])) == 1
    dot = CylinderFill(phase="oil", base=(0.5, 0.5, 0.5), radius=0.01, height=0.01)
    with pytest.raises(ScenarioError, match=r"fill\.dot has no particle"):
        starting_positions({"dot": dot}, TANK, 0.1, 3)


def test_plane_case_lies_at_y_zero() -> None:
    block = BlockFill(phase="water", lower=(0.0, 0.0, 0.0), upper=(0.5, 1.0, 0.4))
    points = region_points(block, TANK, 0.1, 2)
    assert len(points) == 5 * 4
    assert not points[:, 1].any()


@pytest.mark.parametrize("name", sorted(set(library_paths()) - MILLIMETRES - WITHOUT_PARTICLES))
@pytest.mark.parametrize("spacing", [0.05, 0.1])
def test_shipped_scenarios_survive_another_spacing(name: str, spacing: float) -> None:
    """Every region keeps particles, all of them inside the tank, and no two nearer than 0.9 spacings."""
    scenario = load_scenario(name, overrides=[f"fluid.particle_spacing={spacing}"]).scenario
    positions = starting_positions(scenario.fill, scenario.tank, spacing, scenario.fluid.dimension)
    everything = np.concatenate(list(positions.values()))
    assert all(len(points) for points in positions.values())
    if scenario.fluid.dimension == 3:
        assert (everything > np.array(scenario.tank.lower)).all()
        assert (everything < np.array(scenario.tank.upper)).all()
    distance, _ = cKDTree(everything).query(everything, k=2)
    assert distance[:, 1].min() >= 0.9 * spacing


FLOATING = """
name = "float"
run = {duration = 1.0, communication_step = 0.02}
fluid = {particle_spacing = 0.1}
phases.water = {density = 1000.0, dynamic_viscosity = 1e-3}
tank = {lower = [0.0, 0.0, 0.0], upper = [1.0, 1.0, 2.0]}
fill.water = {shape = "slab", phase = "water", bottom = 0.0, top = TOP}
bodies.box = {shape = "box", size = [0.4, 0.4, 0.4], position = [0.5, 0.5, TOP], density = 500.0}
"""


@pytest.mark.parametrize(("top", "off"), [(0.64, -0.04), (0.65, 0.05), (0.67, 0.03), (0.6, 0.0), (1.304, 0.0)])
def test_a_surface_off_its_top_is_told_where_bodies_float_by_it(tmp_path: Path, top: float, off: float) -> None:
    """In whole layers water ends up to half a spacing off; `check` and the run say by how much, and which way bodies move."""
    (tmp_path / "float.toml").write_text(FLOATING.replace("TOP", str(top)))
    scenario = load_scenario(tmp_path / "float.toml").scenario
    told = [text for text in estimate(scenario).told if "bodies placed afloat" in text]
    assert len(told) == (abs(off) > 0.005)
    for text in told:
        assert (
            f"end at {top + off:.4g} m, {abs(off):.2g} m {'above' if off > 0 else 'below'} its top of {top:g} m" in text
        )
        assert ("move up" in text) == (off > 0)
    assert build_simulators(resolve(scenario)).facts == tuple(told)
    (tmp_path / "float.toml").write_text(
        FLOATING.replace("TOP", str(top)).replace("density = 500.0", 'motion = "fixed"')
    )
    assert not [
        text
        for text in estimate(load_scenario(tmp_path / "float.toml").scenario).told
        if "bodies placed afloat" in text
    ]


STROKE = '{{kind = "sine", direction = [1.0, 0.0, 0.0], amplitude = {}, period = 2.0}}'
WAVY = """
name = "wavy"
run = {duration = 1.0, communication_step = 0.02, seed = SEED}
fluid = {particle_spacing = 0.1}
phases.water = {density = 1000.0, dynamic_viscosity = 1e-3}
tank = {lower = [0.0, 0.0, 0.0], upper = [3.0, 1.0, 2.0]}
fill.water = {shape = "slab", phase = "water", bottom = 0.0, top = 0.6}
bodies.piston = {shape = "box", size = [0.2, 1.0, 1.2], position = [0.1, 0.5, 0.6], contact = false, motion = MOTION}
"""


def test_water_of_low_waves_begins_off_its_lattice(tmp_path: Path) -> None:
    """By up to 0.3 spacings, by the run's seed, clear of bodies; higher waves melt a lattice by themselves."""

    def points(amplitude: float, seed: int) -> np.ndarray:
        (tmp_path / "wavy.toml").write_text(WAVY.replace("MOTION", STROKE.format(amplitude)).replace("SEED", str(seed)))
        return lay_out(resolve(load_scenario(tmp_path / "wavy.toml").scenario)).positions["water"]

    low, high = points(0.05, 1), points(0.15, 1)
    assert np.abs(high / 0.1 % 1.0 - 0.5).max() < 1e-6
    off = np.abs(low / 0.1 % 1.0 - 0.5)
    assert off.max() < 0.3 + 1e-6 and off.mean() == pytest.approx(0.15, rel=0.05)
    assert np.array_equal(low, points(0.05, 1)) and not np.array_equal(low[:, 2], points(0.05, 2)[: len(low), 2])
    assert (low[:, 0] > 0.2).all()


@pytest.mark.slow
@pytest.mark.parametrize(("count", "kept"), [(16, 0.9), (32, 0.9), (64, 0.98)])
def test_low_waves_last_longer_off_the_lattice(count: int, kept: float) -> None:
    """A standing wave of half a spacing, five periods: 0.79, 0.84 and 0.98 a period are left on the lattice, 0.96, 0.95, 0.985 off it."""
    spacing, depth = 1.0 / count, 0.5
    number = 2.0 * np.pi
    omega = np.sqrt(9.81 * number * np.tanh(number * depth))
    fluid = Fluid(
        FluidConfig(
            particle_spacing=spacing, phases=(Phase(name="water", rest_density=1000.0),), lower=(0, 0, -0.1), upper=(1, 1, 1),
            periodic=(True, False, False), dimension=2,
        ),
        1,
    )  # fmt: skip
    fluid.add_boundary(
        tank_walls((0, 0, 0), (1, 0, 0.9), spacing, sides=("-z",), periodic=(True, False, False), dimension=2)
    )
    points = off_lattice({"water": block((0, 0, 0), (1, 0, depth), spacing, 2)}, spacing, 2, 1)["water"]

    def swing(x: np.ndarray, z: np.ndarray) -> np.ndarray:
        size = 0.5 * spacing * omega / np.sinh(number * depth)
        return size * np.stack(
            [np.sin(number * x) * np.cosh(number * z), 0.0 * x, -np.cos(number * x) * np.sinh(number * z)]
        )

    fluid.add_particles(points, phase="water", velocity=swing(points[:, 0], points[:, 2]).T)
    period, found = round(2.0 * np.pi / omega / 0.01), []
    for _ in range(5 * period):
        fluid.advance(0.01)
        now = fluid.particles
        mode = swing(now.position[0], now.position[2])
        found.append((mode * now.velocity).sum() / (mode * mode).sum())
    fluid.close()
    turned = np.exp(-1j * omega * 0.01 * np.arange(period))
    first, last = (abs((np.array(part) * turned).sum()) for part in (found[:period], found[-period:]))
    assert (last / first) ** 0.25 > kept
