"""Ground tackle: holding power by ground, and the weights and strengths of chains and ropes."""

from __future__ import annotations

import math

import pytest

from oilsim.core.physical_constants import GRAVITY
from vessels.ground_tackle import AnchorSize, Rope, laid_anchor, leg_part

PLACE = (0.0, 0.0, -10.0)


def test_flukes_hold_more_in_clay_than_in_sand_and_mud() -> None:
    grounds = ("mud", "sand", "clay")
    mud, sand, clay = (laid_anchor("fluke", 25.0, ground, PLACE).holding / (25.0 * GRAVITY) for ground in grounds)
    assert (mud, sand, clay) == pytest.approx((13.0, 16.0, 20.0))
    assert 25.0 * mud == pytest.approx(
        350.0, rel=0.1
    )  # kgf, ITOPF's table for 25 kg; it has 400 in sand and 500 in clay
    assert laid_anchor("stockless", 25.0, "sand", PLACE).holding < 0.3 * sand * 25.0 * GRAVITY


def test_anchor_loses_half_its_power_at_fifteen_degrees() -> None:
    anchor = laid_anchor("fluke", 25.0, "sand", PLACE)
    assert anchor.power(1000.0, 1000.0 * math.tan(math.radians(15.0))) == pytest.approx(0.5 * anchor.holding)
    assert anchor.power(1000.0, 1000.0) == 0.0


def test_weight_slides_by_friction() -> None:
    block = laid_anchor("weight", 1000.0, "rock", PLACE)
    assert block.holding == pytest.approx(0.6 * 0.57 * 1000.0 * GRAVITY)
    assert block.power(100.0, 0.57 * 1000.0 * GRAVITY) == pytest.approx(0.0)  # lifted


def test_fixed_ones_and_tested_ones_hold_as_stated() -> None:
    assert math.isinf(laid_anchor("fixed", 0.0, "rock", PLACE).holding)
    assert laid_anchor("fluke", 25.0, "rock", PLACE, 900.0).holding == 900.0
    with pytest.raises(ValueError, match="kind 'fluke' finds no hold in rock"):
        laid_anchor("fluke", 25.0, "rock", PLACE)


def test_chain_and_ropes_as_their_tables() -> None:
    # makers: 13 mm chain 3.4 kg/m in air and some 97 kN in grade 2, 20 mm polyester some 70 kN, 20 mm wire some 230 kN
    chain = leg_part("chain", Rope(length=10.0, diameter=0.013))
    assert chain.weight / GRAVITY == pytest.approx(0.87 * 3.37, rel=0.02)
    assert chain.breaking_load == pytest.approx(97e3, rel=0.05)
    assert leg_part("polyester", Rope(length=10.0, diameter=0.02)).breaking_load == pytest.approx(68e3, rel=0.02)
    assert leg_part("wire", Rope(length=10.0, diameter=0.02)).breaking_load == pytest.approx(233e3, rel=0.02)
    assert leg_part("nylon", Rope(length=10.0, diameter=0.02), 5e3).breaking_load == 5e3


@pytest.mark.parametrize(
    "made",
    [
        lambda: Rope(length=0.0, diameter=0.02),
        lambda: Rope(length=2500.0, diameter=0.02),
        lambda: Rope(length=10.0, diameter=0.001),
        lambda: AnchorSize(mass=-1.0),
    ],
)
def test_impossible_tackle_is_refused(made: object) -> None:
    with pytest.raises(ValueError, match="allowed"):
        made()  # type: ignore[operator]
