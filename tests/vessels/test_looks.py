"""A vessel is drawn as large as she is, and particles see no other hull than the one that is drawn below her deck."""

from __future__ import annotations

import numpy as np
import pytest

from recordings.model import palette
from vessels.hull import float_hull, raked_barge
from vessels.looks import drawn_vessel

HULL = float_hull(raked_barge(15.0, 5.0, 1.6, 3.0, rake=2.0), 1.6, water_density=1027.0)


@pytest.mark.parametrize("with_lines", [True, False])
@pytest.mark.parametrize("area", [0.0, 4.0, 36.0])
def test_hull_and_superstructure_have_their_size(with_lines: bool, area: float) -> None:
    drawn = drawn_vessel(HULL, area, with_lines=with_lines)
    assert drawn.face_colors is not None
    low, high = drawn.vertices.min(axis=0), drawn.vertices.max(axis=0)
    assert high[:2] - low[:2] == pytest.approx([15.0, 5.0], abs=1e-5)
    assert low[2] == pytest.approx(HULL.waterline - 1.6, abs=1e-5)
    house = drawn.vertices[drawn.faces[(drawn.face_colors == palette.HOUSE).all(axis=1)]]
    broad, high_up = np.ptp(house[..., 1]), house[..., 2].max() - (HULL.waterline + 1.4)
    assert broad <= 0.8 * 5.0 + 1e-5
    assert area == 0.0 or broad * high_up == pytest.approx(area, rel=1e-5)


def test_the_hull_that_particles_meet_is_drawn_as_it_is() -> None:
    drawn = drawn_vessel(HULL, 0.0, with_lines=False)
    count = len(HULL.mesh.vertices)
    np.testing.assert_allclose(drawn.vertices[:count], HULL.mesh.vertices, atol=1e-6)
    np.testing.assert_array_equal(drawn.faces[: len(HULL.mesh.faces)], HULL.mesh.faces)


def test_the_deck_is_above_the_water_and_the_bottom_below() -> None:
    drawn = drawn_vessel(HULL, 0.0, with_lines=True)
    height = drawn.vertices[drawn.faces][..., 2] - HULL.waterline
    painted = {
        name: (drawn.face_colors == color).all(axis=1)
        for name, color in (("deck", palette.DECK), ("bottom", palette.BOTTOM))
    }
    assert height[painted["deck"]].min() == pytest.approx(1.4, abs=1e-5)
    assert height[painted["bottom"]].max() <= 1e-5
    assert painted["bottom"].sum() > 10
