"""The oil ledger: each litre in one row, words and codes that others read, and an account that goes back with the run."""

from __future__ import annotations

import copy

import numpy as np
import pytest

from oilsim.oil.fates import CAUSES, FATES, Fate, LossCause
from oilsim.oil.ledger import BoomOil, OilLedger, OilRows, rows_of
from recordings.model.frame import RunDescription
from recordings.model.words import CAUSE_IN_WORDS


def test_names_and_codes_of_fates_are_one_table() -> None:
    assert [FATES[fate] for fate in Fate if fate != Fate.LOST] == [one.name.lower() for one in Fate if one != Fate.LOST]
    assert [FATES[Fate.LOST + cause] for cause in LossCause] == [f"lost_{cause}" for cause in CAUSES]
    run = RunDescription(name="fates", particle_spacing=1.0, fates=FATES)
    assert run.causes == {cause: Fate.LOST + place for place, cause in enumerate(CAUSES)}
    assert set(CAUSES) <= set(CAUSE_IN_WORDS)  # each has words for people


@pytest.mark.parametrize("volume", [0.125, np.random.default_rng(3).random(400)])
def test_rows_add_up_to_what_was_spilled(volume: float | np.ndarray) -> None:
    """Of 400 parcels of any fate, beside 3 m3 that are gone: sums by fate, and the modelled part of what is lost."""
    random = np.random.default_rng(5)
    fate, modelled = random.integers(0, len(FATES), 400), random.random(400) < 0.5
    volumes = np.broadcast_to(volume, 400)
    rows = rows_of(float(volumes.sum()) + 3.0, volume, fate, modelled, left_the_domain=3.0)
    assert abs(rows.residual) < 1e-12
    assert rows.stranded == pytest.approx(volumes[fate == Fate.STRANDED].sum())
    assert rows.left_the_domain == pytest.approx(3.0 + volumes[fate == Fate.LEFT_THE_DOMAIN].sum())
    planing = fate == Fate.LOST + LossCause.PLANING
    assert rows.lost["planing"] == pytest.approx(volumes[planing].sum())
    assert rows.lost_modelled["planing"] == pytest.approx(volumes[planing & modelled].sum())
    listed = {name.removeprefix("oil/"): value for name, value in rows.series().items()}
    summed = sum(value for name, value in listed.items() if name not in ("spilled", "recontained", "resolved"))
    assert summed == pytest.approx(listed["spilled"], rel=1e-12)
    assert rows.summary()["lost"] == pytest.approx({name: value for name, value in rows.lost.items() if value})


def test_a_boom_has_met_the_most_that_it_ever_held_lost_or_passed_to_skimmers() -> None:
    ledger, lost = OilLedger(), dict.fromkeys(CAUSES, 0.0)
    assert ledger.enter("a", BoomOil(recovered=2.0)).met == 0.0  # taken beside a boom that never had oil
    assert ledger.enter("a", BoomOil(contained=3.0, lost=lost | {"planing": 1.0})).met == 4.0
    floated_off = ledger.enter("a", BoomOil(contained=1.0, lost=lost | {"planing": 1.0}))
    assert (floated_off.met, floated_off.contained_share) == (4.0, 0.75)
    assert ledger.enter("a", BoomOil(contained=3.0, recovered=2.0, lost=lost)).met == 5.0
    assert ledger.enter("b", BoomOil(contained=1.0)).met == 1.0


def test_a_ledger_goes_back_with_the_run() -> None:
    """A step is taken back and made anew: the rows, what was there first, and what each boom has met are as before it."""
    ledger = OilLedger()
    assert ledger.begin_with(7.0) == 7.0
    ledger.enter("a", BoomOil(contained=2.0, recontained=0.5))
    ledger.close(OilRows(spilled=7.0, afloat=5.0, contained=2.0))
    saved, rows, booms = copy.deepcopy(ledger.save_state()), ledger.rows, dict(ledger.booms)
    assert rows.recontained == 0.5
    ledger.enter("a", BoomOil(contained=6.0))
    ledger.close(OilRows(spilled=9.0, afloat=3.0, contained=6.0))
    ledger.restore_state(saved)
    assert (ledger.rows, ledger.booms, ledger.begin_with(9.0)) == (rows, booms, 7.0)
    assert ledger.enter("a", BoomOil(contained=1.0)).met == 2.0
    other = OilLedger()
    other.restore_state(saved)
    assert (other.rows, other.begin_with(1.0)) == (rows, 7.0)
