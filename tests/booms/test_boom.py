"""Boom sections, segments and classes: geometry against formulas, stability, what the fluid can resolve."""

import math
from dataclasses import fields, replace

import numpy as np
import pytest
from scipy.constants import foot, inch, pound_force

from booms.boom import (
    FABRIC_SHEAR,
    Boom,
    BoomDesign,
    catalogue,
    minimum_thickness,
    section_area,
    section_buoyancy_to_weight,
)
from booms.segments import boom_segment, segment_mesh
from coupling.solids.hydrostatics import waterline_for_volume
from tests.booms.laid import of_the_catalogue


def box_boom(**changes):
    options = {
        "length": 4.0,
        "segment_count": 16,
        "skirt_depth": 0.2,
        "freeboard": 0.1,
        "float_width": 0.12,
        "float_draft": 0.03,
        "skirt_thickness": 0.01,
        "design_skirt_thickness": 0.01,
        "float_shape": "box",
        "maximum_turn": math.radians(60.0),
        "water_density": 1000.0,
    }
    return Boom(**(options | changes))


def test_box_section_area():
    boom = box_boom()
    below = 0.12 * 0.03 + 0.01 * 0.17  # float and skirt under water
    assert section_area(boom, 0.0) == pytest.approx(below, rel=1e-12)
    assert section_area(boom, 0.1) == pytest.approx(below + 0.12 * 0.1, rel=1e-12)
    assert section_buoyancy_to_weight(boom) == pytest.approx((below + 0.012) / below, rel=1e-12)


def test_segment_mesh_is_closed_and_has_the_volume_of_its_section():
    boom = box_boom()
    mesh = segment_mesh(boom)
    assert mesh.is_watertight and mesh.is_winding_consistent
    # breadth falls linearly to 0 over the taper at both ends: V = A (l - taper)
    assert mesh.volume == pytest.approx(section_area(boom, 1.0) * (boom.segment_length - boom.taper), rel=1e-9)
    assert mesh.bounds == pytest.approx(np.array([[-0.125, -0.06, -0.2], [0.125, 0.06, 0.1]]))


def test_round_float_has_nearly_the_area_of_its_circle():
    boom = box_boom(float_shape="cylinder", float_width=0.13, skirt_thickness=1e-3)
    assert section_area(boom, 1.0) == pytest.approx(math.pi / 4 * 0.13**2 + 1e-3 * 0.17, rel=0.02)


def test_segment_floats_at_its_design_waterline():
    segment = boom_segment(box_boom())
    volume = segment.mass_properties.mass / 1000.0
    assert waterline_for_volume(segment.mesh, volume) == pytest.approx(segment.waterline, abs=1e-9)
    assert segment.mesh.bounds[0, 2] == pytest.approx(segment.waterline - 0.2)  # skirt depth
    assert segment.mesh.bounds[1, 2] == pytest.approx(segment.waterline + 0.1)  # freeboard


def test_ballast_at_the_foot_lowers_the_centre_of_mass_by_its_lever():
    light, heavy = (boom_segment(box_boom(ballast_fraction=share)) for share in (0.2, 0.5))
    # z_G = (1 - b) z_even + b (-skirt depth): linear in the ballast's share b
    even = (-light.waterline + 0.2 * 0.2) / 0.8
    assert -heavy.waterline == pytest.approx(0.5 * even - 0.5 * 0.2, rel=1e-9)
    assert heavy.hydrostatics.metacentric_height(0.0) > light.hydrostatics.metacentric_height(0.0) > 0.0


def test_metacentric_height_of_a_segment():
    boom = box_boom(ballast_fraction=0.4)  # nearly prismatic
    segment = boom_segment(boom)
    below = 0.12 * 0.03 + 0.01 * 0.17
    buoyancy = -(0.12 * 0.03 * 0.015 + 0.01 * 0.17 * 0.115) / below
    whole = below + 0.012
    even = (-(0.12 * 0.03 * 0.015 + 0.01 * 0.17 * 0.115) + 0.12 * 0.1 * 0.05) / whole
    gravity = 0.6 * even - 0.4 * 0.2
    # GM = I / V + z_B - z_G, I = w^3 / 12 a length
    assert segment.hydrostatics.metacentric_height(0.0) == pytest.approx(
        0.12**3 / 12 / below + buoyancy - gravity, rel=0.01
    )


def test_top_heavy_boom_is_refused():
    with pytest.raises(ValueError, match="capsize"):
        boom_segment(box_boom(ballast_fraction=0.0, freeboard=0.6, float_width=0.05))


def test_inertia_of_the_ballast_rod():
    even = []
    for share in (0.3, 0.5):
        properties = boom_segment(box_boom(ballast_fraction=share)).mass_properties
        # yaw: I = (1 - b) I_even + b m l^2 / 12; both lie on the axis, so no Steiner term
        even.append((properties.inertia[2, 2] - share * properties.mass * 0.25**2 / 12) / (1.0 - share))
    assert even[0] == pytest.approx(even[1], rel=1e-9)


@pytest.mark.parametrize("shape", ["box", "cylinder"])
@pytest.mark.parametrize("ratio", [3.0, 8.0])
def test_float_is_sized_to_the_buoyancy_to_weight_ratio(shape, ratio):
    boom = BoomDesign(
        length=10.0,
        segment_count=20,
        skirt_depth=0.2,
        freeboard=0.1,
        buoyancy_to_weight=ratio,
        skirt_thickness=0.004,
        float_shape=shape,
    ).boom()
    segment = boom_segment(boom)
    assert segment.mesh.volume / segment.hydrostatics.displaced_volume == pytest.approx(ratio, rel=1e-6)
    # reserve: all of the volume under water lifts ratio times the weight
    lift = boom.water_density * segment.mesh.volume
    assert lift == pytest.approx(ratio * segment.mass_properties.mass, rel=1e-6)


def test_ratio_out_of_reach_is_refused_with_the_range():
    with pytest.raises(ValueError, match="buoyancy_to_weight is 50, allowed: "):
        BoomDesign(
            length=10.0,
            segment_count=10,
            skirt_depth=0.5,
            freeboard=0.1,
            buoyancy_to_weight=50.0,
            skirt_thickness=0.02,
        ).boom()


@pytest.mark.parametrize("spacing", [0.005, 0.05])
def test_boom_is_made_thick_enough_for_the_particles_and_says_so(spacing):
    boom = box_boom()
    resolved = boom.resolved_by(spacing)
    assert resolved.skirt_thickness == max(0.01, minimum_thickness(spacing))
    assert resolved.design_skirt_thickness == 0.01
    assert (resolved.skirt_depth, resolved.freeboard) == (boom.skirt_depth, boom.freeboard)
    assert boom_segment(resolved).hydrostatics.metacentric_height(0.0) > 0.0
    # what is not ballast keeps its mass
    masses = [boom_segment(b).mass_properties.mass * (1.0 - b.ballast_fraction) for b in (boom, resolved)]
    assert masses[0] == pytest.approx(masses[1], rel=1e-9)


@pytest.mark.parametrize("name", list(catalogue()))
def test_every_boom_of_the_catalogue_makes_an_upright_boom_of_its_ratio(name):
    entry = catalogue()[name]
    segment = boom_segment(of_the_catalogue(name, 80.0, 30))
    assert segment.mesh.is_watertight
    assert segment.hydrostatics.metacentric_height(0.0) > 0.0
    assert segment.mesh.volume / segment.hydrostatics.displaced_volume == pytest.approx(
        entry.buoyancy_to_weight, rel=1e-6
    )


def test_navy_classes_are_those_of_the_salvage_manual():
    for name, skirt, freeboard, knots in (("nafac-1", 8, 4, 1.0), ("nafac-2", 16, 8, 1.5), ("nafac-3", 24, 12, 2.0)):
        entry = catalogue()[name]
        assert (entry.skirt_depth / inch, entry.freeboard / inch) == pytest.approx((skirt, freeboard))
        assert entry.section_length == pytest.approx(500 * foot)
        assert entry.maximum_speed_kn == knots


def test_classes_of_the_coast_guard_have_its_strengths_and_reserve_buoyancy():
    """33 CFR 155 appendix B table 1; the height is skirt and freeboard together, the reserve ratio is the gross ratio less 1."""
    for name, lowest, highest, reserve, pounds in (
        ("cfr-rivers", 6, 18, 2, 4_500),
        ("cfr-inland", 18, 42, 2, 15_000),
        ("cfr-great-lakes", 18, 42, 2, 15_000),
        ("cfr-ocean", 42, 60, 3, 20_000),
    ):
        entry = catalogue()[name]
        assert lowest - 1e-9 <= (entry.skirt_depth + entry.freeboard) / inch <= highest + 1e-9
        assert entry.buoyancy_to_weight >= reserve + 1.0
        assert entry.strength == pytest.approx(pounds * pound_force, rel=2e-3)


def test_every_figure_has_a_source_or_is_said_to_be_assumed():
    for entry in catalogue().values():
        assert entry.source
        parts = [part for part in (entry.pocket,) if part is not None]
        inner = {f"{type(part).__name__.lower()}.{item.name}" for part in parts for item in fields(part)}
        assert set(entry.assumed) <= {item.name for item in fields(entry)} | inner


def test_all_impossible_dimensions_are_named_at_once():
    with pytest.raises(ValueError) as caught:
        box_boom(freeboard=-0.1, float_draft=0.3, ballast_fraction=1.0)
    for name in ("freeboard", "float_draft", "ballast_fraction"):
        assert name in str(caught.value)


def test_the_twisting_stiffness_of_a_round_float_is_that_of_a_thin_tube() -> None:
    """2 pi r^3 G t / L, of a tube of radius r: Bredt's formula with A = pi r^2 and s = 2 pi r."""
    design = BoomDesign(
        length=30.0, segment_count=10, skirt_depth=0.6, freeboard=0.4, buoyancy_to_weight=8.0, skirt_thickness=0.005
    )
    boom = design.boom()
    radius = 0.5 * boom.float_width
    assert boom.freeboard + boom.float_draft == pytest.approx(boom.float_width)
    assert boom.twisting_stiffness == pytest.approx(2.0 * math.pi * radius**3 * FABRIC_SHEAR / 3.0)
    assert replace(boom, float_shape="box").twisting_stiffness == pytest.approx(
        (2.0 * radius) ** 3 * FABRIC_SHEAR / 3.0
    )
