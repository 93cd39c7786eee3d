"""Scenes of the test kit that cannot be right are refused in words, not run; and their level and checks hold where they are strained."""

from __future__ import annotations

import math
from typing import Any

import pytest

from coupling.solids.bodies import about_center_of_mass, box, mass_properties
from coupling.testkit import Scene, TankScene, assert_momentum_conserved, empty_space, tank

NAN = math.nan


def small_tank(**terms: Any) -> TankScene:
    return tank(**{"size": (0.6, 0.6, 0.8), "depth": 0.3, "particle_spacing": 0.1} | terms)


def add_box(scene: Scene, name: str = "raft", **terms: Any) -> None:
    scene.add_body(name, box((0.2, 0.2, 0.2)), **{"density": 500.0, "position": (0.3, 0.3, 0.4)} | terms)


@pytest.mark.parametrize(
    ("terms", "message"),
    [
        ({"size": (0.6, 0.6)}, r"tank: size has shape \(2,\), allowed: \(3\)"),
        ({"size": (0.6, NAN, 0.6)}, r"tank: size has nan at \(1,\), allowed: finite numbers"),
        ({"size": (0.6, 0.0, 0.6)}, r"tank: size is \(0\.6, 0\.0, 0\.6\) m, allowed: above 0"),
        ({"depth": NAN}, r"tank: depth is nan m, allowed: above 0, to its height of 0\.8 m"),
        ({"depth": 5.0}, r"tank: depth is 5\.0 m, allowed: above 0, to its height of 0\.8 m"),
    ],
)
def test_tanks_that_cannot_be(terms: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        small_tank(**terms)


@pytest.mark.parametrize(
    ("terms", "message"),
    [
        ({"position": (0.3, 0.3)}, r"position of 'raft' has shape \(2,\), allowed: \(3\)"),
        ({"position": (NAN, 0.0, 0.0)}, r"position of 'raft' has nan at \(0,\), allowed: finite numbers"),
        ({"twist": (0.0, 0.0)}, r"twist of 'raft' has shape \(2,\), allowed: \(6\)"),
        ({"twist": (0.0, 0.0, 0.0, NAN, 0.0, 0.0)}, r"twist of 'raft' has nan at .* allowed: finite numbers"),
        ({"orientation": (0.0, 0.0, 1.0)}, r"orientation of 'raft' has shape \(3,\), allowed: \(4\)"),
        ({"orientation": (0.0, 0.0, 0.0, 2.0)}, "orientation of 'raft' is .* allowed: a unit quaternion"),
    ],
)
def test_bodies_that_cannot_be(terms: dict[str, Any], message: str) -> None:
    with small_tank() as scene, pytest.raises(ValueError, match=f"rigid bodies: {message}"):
        add_box(scene, **terms)


def test_a_mesh_off_its_centre_of_mass_is_refused() -> None:
    mesh = box((0.2, 0.2, 0.2)).apply_translation((0.1, 0.0, 0.0))
    with small_tank() as scene:
        with pytest.raises(
            ValueError,
            match=r"mesh of body 'raft' has its centre of mass at \[0\.1.* m, allowed: at 0; .*about_center_of_mass",
        ):
            scene.add_body("raft", mesh, density=500.0, position=(0.3, 0.3, 0.4))
        moved = about_center_of_mass(mesh, mass_properties(mesh, density=500.0))
        scene.add_body("raft", moved, density=500.0, position=(0.3, 0.3, 0.4))


@pytest.mark.parametrize(
    ("position", "message"),
    [
        ((0.0, 0.3, 0.4), r"'raft' lies 0\.1 m deep in a side of the tank"),
        ((0.3, 0.3, 0.6), r"'(raft|stone)' lies 0\.1 m deep in body "),
    ],
)
def test_bodies_that_begin_in_each_other_or_in_a_side(position: tuple[float, float, float], message: str) -> None:
    with small_tank() as scene:
        add_box(scene, position=position)
        add_box(scene, "stone", position=(0.3, 0.3, 0.7))
        with pytest.raises(ValueError, match=message + r".* at the start, allowed: up to 0\.05 m"):
            scene.step()


def test_a_body_that_comes_after_the_run_has_begun_is_refused() -> None:
    with small_tank() as scene:
        scene.step()
        with pytest.raises(ValueError, match="body 'raft' is added after the run has begun, allowed: before"):
            add_box(scene)


def test_liquid_that_cannot_be() -> None:
    with empty_space(size=(2.0, 2.0, 2.0), particle_spacing=0.1) as scene:
        for terms, message in (
            (
                ((NAN, 0, 0), (0.3, 0.3, 0.3), (0, 0, 0)),
                r"lower corner of the liquid has nan at .* allowed: finite numbers",
            ),
            (((0, 0, 0), (0.3, 0.3), (0, 0, 0)), r"upper corner of the liquid has shape \(2,\), allowed: \(3\)"),
            (
                ((0, 0, 0), (0.3, 0.3, 0.3), (NAN, 0, 0)),
                r"velocity of the liquid has nan at .* allowed: finite numbers",
            ),
        ):
            lower, upper, velocity = terms
            with pytest.raises(ValueError, match=f"scene: {message}"):
                scene.fill(lower, upper, velocity=velocity)  # type: ignore[arg-type]


@pytest.mark.parametrize("duration", [NAN, -1.0, 0.0])
def test_runs_that_lead_nowhere(duration: float) -> None:
    with small_tank() as scene, pytest.raises(ValueError, match=r"duration of the run is .* s, allowed: above 0"):
        scene.run(duration)


def test_a_check_of_no_step_checks_nothing() -> None:
    with (
        empty_space(size=(2.0, 2.0, 2.0), particle_spacing=0.1) as scene,
        pytest.raises(ValueError, match="steps is 0, allowed: 1 or more"),
    ):
        assert_momentum_conserved(scene, steps=0)


def test_momentum_of_bodies_that_fly_apart_is_compared_with_what_each_of_them_has() -> None:
    with empty_space(size=(4.0, 4.0, 4.0), particle_spacing=0.1, communication_step=1.0 / 240.0) as scene:
        for name, side in (("a", -1.0), ("b", 1.0)):
            scene.add_body(
                name, box((0.3, 0.4, 0.5)), density=100.0, position=(side, 0.0, 0.0),
                twist=(side, 0.3 * side, 0.0, 1.0, 2.0, 3.0),
            )  # fmt: skip
        assert_momentum_conserved(scene, steps=10)
        scene.world.set_applied_wrench("a", [0.0, 0.0, 0.0, 0.0, 1.0, 0.0])
        with pytest.raises(AssertionError, match=r"momentum changes by .* N m s"):
            assert_momentum_conserved(scene)


@pytest.mark.parametrize("width", [0.5, 0.8, 0.94])
def test_level_about_a_body_that_nearly_fills_the_tank(width: float) -> None:
    under = 0.35  # [m] of water below the body
    with tank(size=(1.0, 1.0, 1.2), depth=0.4, particle_spacing=0.1) as scene:
        scene.fill((0.0, 0.0, 0.0), (1.0, 1.0, 0.4))
        scene.add_body("barge", box((width, width, 0.6)), density=500.0, position=(0.5, 0.5, under + 0.3))
        assert scene.level() == pytest.approx((0.4 - width**2 * under) / (1.0 - width**2), abs=1e-9)
