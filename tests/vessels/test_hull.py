"""Hull shapes against their analytic form, and hulls that float upright at their design draft."""

import numpy as np
import pytest
import trimesh

from coupling.solids.hydrostatics import hydrostatics, waterline_for_volume
from vessels.hull import float_hull, raked_barge, wigley_hull

LENGTH, BEAM, DRAFT, DEPTH = 1.2, 0.3, 0.15, 0.25


def test_hydrostatics_of_a_box_are_those_of_the_formula():
    box = trimesh.creation.box((2.0, 0.6, 0.5))
    form = hydrostatics(box, -0.05)  # draft 0.2 of a box whose bottom lies at -0.25
    assert form.displaced_volume == pytest.approx(2.0 * 0.6 * 0.2, rel=1e-12)
    assert form.center_of_buoyancy == pytest.approx([0.0, 0.0, -0.15], abs=1e-12)
    assert form.waterplane_area == pytest.approx(1.2, rel=1e-12)
    assert form.roll_second_moment == pytest.approx(2.0 * 0.6**3 / 12.0, rel=1e-12)  # L B^3 / 12
    assert form.pitch_second_moment == pytest.approx(0.6 * 2.0**3 / 12.0, rel=1e-12)  # B L^3 / 12
    # GM = I / V + z_B - z_G = B^2 / (12 T) + z_B - z_G
    assert form.metacentric_height(0.01) == pytest.approx(0.6**2 / (12 * 0.2) - 0.15 - 0.01, rel=1e-12)


def test_hydrostatics_use_the_waterplanes_own_centre():
    box = trimesh.creation.box((2.0, 0.6, 0.5))
    moved = box.copy()
    moved.apply_translation((3.0, -1.0, 0.0))
    here, there = hydrostatics(box, 0.1), hydrostatics(moved, 0.1)
    assert there.waterplane_center == pytest.approx([3.0, -1.0])
    assert there.roll_second_moment == pytest.approx(here.roll_second_moment, rel=1e-9)
    assert there.pitch_second_moment == pytest.approx(here.pitch_second_moment, rel=1e-9)


def test_half_sunk_sphere():
    sphere = trimesh.creation.icosphere(subdivisions=5, radius=0.5)
    form = hydrostatics(sphere, 0.0)
    assert form.displaced_volume == pytest.approx(2 / 3 * np.pi * 0.125, rel=2e-3)
    assert form.center_of_buoyancy[2] == pytest.approx(-3 / 8 * 0.5, rel=2e-3)
    assert waterline_for_volume(sphere, 0.5 * sphere.volume) == pytest.approx(0.0, abs=1e-6)
    # the metacentre of a floating sphere is its centre
    assert form.metacentric_height(0.0) == pytest.approx(0.0, abs=2e-3)


def test_what_lies_all_under_water_has_no_waterplane():
    for turn in np.random.default_rng(1).normal(size=(20, 4)):
        box = trimesh.creation.box((0.2, 0.3, 0.4))
        box.apply_transform(trimesh.transformations.quaternion_matrix(turn))
        form = hydrostatics(box, 1.0)
        assert form.displaced_volume == pytest.approx(0.024)
        assert form.waterplane_center.tolist() == [0.0, 0.0]
        assert (form.waterplane_area, form.roll_second_moment) == pytest.approx((0.0, 0.0), abs=1e-12)


def test_hydrostatics_refuse_an_open_mesh_and_a_dry_one():
    box = trimesh.creation.box((1.0, 1.0, 1.0))
    with pytest.raises(ValueError, match="lies below the mesh"):
        hydrostatics(box, -0.6)
    with pytest.raises(ValueError, match="displaced volume"):
        waterline_for_volume(box, 1.5)
    box.update_faces(np.arange(len(box.faces)) > 0)
    with pytest.raises(ValueError, match="not watertight"):
        hydrostatics(box, 0.0)


def test_wigley_hull_is_closed_and_has_block_coefficient_four_ninths():
    mesh = wigley_hull(LENGTH, BEAM, DRAFT, DEPTH)
    assert mesh.is_watertight and mesh.is_winding_consistent and mesh.volume > 0
    assert mesh.extents == pytest.approx([LENGTH, BEAM, DEPTH])
    form = hydrostatics(mesh, 0.0)
    assert form.displaced_volume / (LENGTH * BEAM * DRAFT) == pytest.approx(4 / 9, rel=4e-3)
    assert form.waterplane_area / (LENGTH * BEAM) == pytest.approx(2 / 3, rel=1e-3)
    assert form.roll_second_moment / (LENGTH * BEAM**3) == pytest.approx(4 / 105, rel=4e-3)
    assert form.center_of_buoyancy[2] / DRAFT == pytest.approx(-3 / 8, rel=4e-3)
    # deck: wall-sided from the waterline up
    assert mesh.volume - form.displaced_volume == pytest.approx(2 / 3 * LENGTH * BEAM * (DEPTH - DRAFT), rel=1e-3)


def test_wigley_volume_converges_with_second_order():
    exact = 4 / 9 * LENGTH * BEAM * DRAFT
    errors = [
        exact
        - hydrostatics(
            wigley_hull(LENGTH, BEAM, DRAFT, DEPTH, station_count=8 * k, level_count=4 * k), 0.0
        ).displaced_volume
        for k in (1, 2, 4)
    ]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert orders == pytest.approx(2.0, abs=0.05)


def test_wigley_surface_follows_the_formula():
    mesh = wigley_hull(LENGTH, BEAM, DRAFT, DEPTH)
    x, y, z = mesh.vertices[mesh.vertices[:, 2] <= 0.0].T
    half_breadth = BEAM / 2 * (1 - (2 * x / LENGTH) ** 2) * (1 - (z / DRAFT) ** 2)
    assert np.abs(y) == pytest.approx(half_breadth, abs=1e-12)


@pytest.mark.parametrize("rake", [0.0, 0.2])
def test_barge_displaces_its_trapezoid(rake):
    mesh = raked_barge(LENGTH, BEAM, DRAFT, DEPTH, rake=rake)
    waterline_length = LENGTH - 2 * rake * (1 - DRAFT / DEPTH)
    volume = BEAM * DRAFT * 0.5 * (waterline_length + LENGTH - 2 * rake)
    form = hydrostatics(mesh, 0.0)
    assert form.displaced_volume == pytest.approx(volume, rel=1e-12)
    assert form.roll_second_moment == pytest.approx(waterline_length * BEAM**3 / 12, rel=1e-9)


@pytest.mark.parametrize("shape", [wigley_hull, raked_barge])
@pytest.mark.parametrize("density", [1000.0, 1027.0])
def test_hull_floats_at_its_design_draft(shape, density):
    hull = float_hull(shape(LENGTH, BEAM, DRAFT, DEPTH), DRAFT, water_density=density)
    assert hull.mass_properties.mass == pytest.approx(density * hull.hydrostatics.displaced_volume, rel=1e-9)
    # Archimedes, by another route: the waterplane at which the hull displaces its own mass
    waterline = waterline_for_volume(hull.mesh, hull.mass_properties.mass / density)
    assert waterline - hull.mesh.bounds[0, 2] == pytest.approx(DRAFT, abs=1e-9)
    # no trim, no list: the centre of buoyancy lies under the centre of mass, which is the origin
    assert hydrostatics(hull.mesh, waterline).center_of_buoyancy[:2] == pytest.approx([0.0, 0.0], abs=1e-12)
    assert hull.hydrostatics.metacentric_height(0.0) > 0.0


def test_metacentric_height_of_the_wigley_hull():
    center = 0.13
    hull = float_hull(
        wigley_hull(LENGTH, BEAM, DRAFT, DEPTH), DRAFT, water_density=1027.0, center_of_gravity_height=center
    )
    # GM = KB + BM - KG with KB = 5/8 T and BM = I / V = (4/105 L B^3) / (4/9 L B T) = 3/35 B^2 / T
    assert hull.hydrostatics.metacentric_height(0.0) == pytest.approx(
        5 / 8 * DRAFT + 3 / 35 * BEAM**2 / DRAFT - center, rel=0.02
    )


def test_heeled_hull_has_the_righting_moment_of_its_metacentric_height():
    hull = float_hull(raked_barge(LENGTH, BEAM, DRAFT, DEPTH), DRAFT, water_density=1000.0)
    heel = np.radians(1.0)
    heeled = hull.mesh.copy()
    heeled.apply_transform(trimesh.transformations.rotation_matrix(heel, (1, 0, 0)))
    form = hydrostatics(heeled, waterline_for_volume(heeled, hull.hydrostatics.displaced_volume))
    # righting arm = horizontal distance of the centre of buoyancy from the centre of mass = GM sin(heel)
    assert -form.center_of_buoyancy[1] == pytest.approx(
        hull.hydrostatics.metacentric_height(0.0) * np.sin(heel), rel=1e-2
    )


def test_inertia_follows_the_gyration_radii():
    hull = float_hull(raked_barge(LENGTH, BEAM, DRAFT, DEPTH), DRAFT, water_density=1000.0)
    radii = np.array([0.37 * BEAM, 0.25 * LENGTH, 0.25 * LENGTH])
    expected = hull.mass_properties.mass * np.diag(radii**2)
    assert np.allclose(hull.mass_properties.inertia, expected, rtol=1e-12)


def test_hull_refuses_what_cannot_float():
    mesh = wigley_hull(LENGTH, BEAM, DRAFT, DEPTH)
    with pytest.raises(ValueError, match="capsizes"):
        float_hull(mesh, DRAFT, water_density=1000.0, center_of_gravity_height=0.3)
    with pytest.raises(ValueError, match=r"draft is 0\.3 m"):
        float_hull(mesh, 0.3, water_density=1000.0)
    with pytest.raises(ValueError, match="freeboard"):
        wigley_hull(LENGTH, BEAM, DRAFT, DRAFT)
    with pytest.raises(ValueError, match="rake"):
        raked_barge(LENGTH, BEAM, DRAFT, DEPTH, rake=0.7)
