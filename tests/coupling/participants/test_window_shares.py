"""The shares of window and formulas in a body's load: they sum to one, and change no faster than the body moves, wherever it lies."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from coupling.participants.window import FADE, SharedEnvironment, WindowBody, WindowParticipant
from coupling.solids.bodies import box
from coupling.solids.surface_sampling import boundary_particles
from oilsim import Phase
from oilsim.loads.morison import BodyLoads
from oilsim.sea import CurrentProfile, RegularWaves, Sea, SeaDescription, SteadyFlow
from oilsim.window.settings import WindowSettings
from oilsim.window.window import Window

WATER = (Phase(name="water", rest_density=1027.0, dynamic_viscosity=1e-3),)
SPACING, SIZE, RIM, NAME, TIME = 0.2, (3.2, 4.0), 0.8, "bar", 3.0
BAR = box((5.0, 0.4, 0.3))  # its points lie 1.44 m from its middle, farther than the rim is wide
HEIGHT, PERIOD = 0.2, 2.0
STEEPNESS = 0.5 * HEIGHT * (2.0 * np.pi / PERIOD) ** 2 / 9.81  # k a in deep water
FADE_WIDTH = FADE * SPACING

place = st.tuples(st.floats(-4.0, 4.0), st.floats(-4.0, 4.0), st.floats(-0.3, 0.3))
turn = st.tuples(*[st.floats(-3.2, 3.2)] * 3)
small = st.tuples(*[st.floats(-0.05, 0.05)] * 3)


def participant(waves: bool) -> WindowParticipant:
    current = CurrentProfile(flow=SteadyFlow(speed=0.4, direction=2.0))
    sea = SeaDescription(
        depth=20.0, current=current, waves=RegularWaves(height=HEIGHT, period=PERIOD, direction=0.7) if waves else None
    )
    window = Window(WindowSettings(size=SIZE, depth=0.8, spacing=SPACING, rim=RIM), Sea(sea), WATER, threads=1)
    window.follow(np.zeros(2), TIME)
    body = WindowBody(mesh=BAR, sample=partial(boundary_particles, NAME, BAR))
    return WindowParticipant("fluid", window, {NAME: body}, lambda poses: np.zeros(2))


@pytest.fixture(scope="module")
def participants() -> Iterator[dict[str, WindowParticipant]]:
    """A window on a calm sea, and one in waves."""
    made = {
        "calm": participant(False),
        "waves": participant(True),
    }
    yield made
    for one in made.values():
        one.window.fluid.close()


def pose_of(where: tuple[float, ...], turned: tuple[float, ...]) -> np.ndarray:
    return np.concatenate([where, Rotation.from_rotvec(turned).as_quat()])


def share(one: WindowParticipant, pose: np.ndarray) -> float:
    return float(one._shares_of(one._sea_over(pose[None], np.zeros((1, 6)), TIME, 0.0))[0])


@given(place, turn)
@example(
    (0.5 * SIZE[0], 0.0, 0.0), (0.0, 0.0, 0.0)
)  # across the side at which the window ends, with an end in its middle
@settings(max_examples=150, deadline=None)
def test_shares_of_window_and_formulas_sum_to_one(
    participants: dict[str, WindowParticipant], where: tuple[float, ...], turned: tuple[float, ...]
) -> None:
    """A share lies between 0 and 1, and formulas have what the window leaves."""
    pose, one = pose_of(where, turned), participants["calm"]
    found = share(one, pose)
    assert 0.0 <= found <= 1.0
    one.shares.announce(np.array([found]), TIME)
    load = BodyLoads(np.full((1, 6), 7.0), np.full((1, 6, 6), 3.0), np.full((1, 6, 6), 2.0), np.full(1, 0.2))

    class Even:
        def loads(self, time: float, pose: np.ndarray, twist: np.ndarray) -> BodyLoads:
            return load

    left = SharedEnvironment(Even(), (NAME,), one.all_shares).loads(TIME, pose[None], np.zeros((1, 6)))
    for formulas, whole in zip(left, load, strict=True):
        np.testing.assert_allclose(formulas + found * whole, whole, rtol=1e-12)


@given(place, turn, small, small)
@settings(max_examples=150, deadline=None)
@pytest.mark.parametrize(("name", "strain"), [("calm", 1.0), ("waves", 1.0 / (1.0 - STEEPNESS))])
def test_a_share_changes_no_faster_than_the_body_moves(
    participants: dict[str, WindowParticipant],
    name: str,
    strain: float,
    where: tuple[float, ...],
    turned: tuple[float, ...],
    moved: tuple[float, ...],
    spun: tuple[float, ...],
) -> None:
    """A share fades over FADE spacings, so it is continuous: a way w changes it by w / (FADE d) at most, a turn by its way at the points.

    Waves press places at rest together by their steepness k a, and so change a share by a factor of 1 / (1 - k a) more.
    """
    one, pose = participants[name], pose_of(where, turned)
    after = np.concatenate(
        [np.add(where, moved), (Rotation.from_rotvec(spun) * Rotation.from_rotvec(turned)).as_quat()]
    )
    way = np.linalg.norm(moved) + np.linalg.norm(spun) * float(one._reach[0])
    assert abs(share(one, after) - share(one, pose)) <= strain * way / FADE_WIDTH + 1e-9


def test_a_share_is_one_inside_and_none_in_the_rim(participants: dict[str, WindowParticipant]) -> None:
    """The bar stands on end, so its points are in one place in plan."""
    one = participants["calm"]
    deep = [share(one, pose_of((x, 0.0, 0.0), (0.0, 1.57, 0.0))) for x in (0.0, 0.1, -0.1)]
    np.testing.assert_allclose(deep, 1.0)
    outside = [share(one, pose_of((x, 0.0, 0.0), (0.0, 1.57, 0.0))) for x in (1.0, -1.0, 2.0, 3.2, 6.4)]
    np.testing.assert_allclose(outside, 0.0)
