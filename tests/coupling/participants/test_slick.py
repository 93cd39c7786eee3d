"""A slick under the master, with a boom whose poses somebody else prescribes."""

from __future__ import annotations

import numpy as np
import pytest

from coupling.master.co_simulation import CoSimulation
from coupling.master.connection import Connection
from coupling.master.errors import CoSimulationError
from coupling.master.participant import Causality, Participant, Status, StepResult, Variable
from coupling.participants.plan_barriers import Beach, BoomBodies
from coupling.participants.slick import CarryingSea, SlickParticipant
from oilsim.oil.fates import LossCause
from oilsim.slick.barriers import Boom, Outline
from oilsim.slick.oil import Oil
from oilsim.slick.parcels import ParcelState
from oilsim.slick.slick import Slick, SlickSettings
from oilsim.slick.spill_source import SpillSource
from tests.oilsim.slick.flows import UniformFlow

BODIES = [f"segment-{k}" for k in range(12)]
STEP = 0.25
SECTION = {"start": (-2.0, 0.0, 0.0), "end": (2.0, 0.0, 0.0), "foot": (0.0, 0.0, -0.45), "top": (0.0, 0.0, 0.3)}


class TowedBoom(Participant):
    """Twelve segments of 4 m in a V that opens to +x, towed at a speed in +x [m/s]."""

    STATE = ("time",)

    def __init__(self, speed: float) -> None:
        super().__init__("tow", [Variable("poses", "m, 1", (len(BODIES), 7), Causality.OUTPUT)])
        self.speed, self.time = speed, 0.0

    def enter_initialization_mode(self, start_time):
        self.time = start_time

    def get(self, name):
        return np.array([self._pose(body) for body in BODIES])

    def _pose(self, body):
        k = BODIES.index(body)
        heading = np.radians(120.0 if k < 6 else 60.0)
        away = 4.0 * (abs(k - 5.5))
        y = away * np.sin(np.radians(60.0)) * np.sign(k - 5.5)
        x = -30.0 + away * np.cos(np.radians(60.0))
        return np.array([x + self.speed * self.time, y, 0.05, 0.0, 0.0, np.sin(0.5 * heading), np.cos(0.5 * heading)])

    def do_step(self, time, step_size):
        self.time = time + step_size
        return StepResult(Status.OK, self.time)


class PartingBoom(TowedBoom):
    """The same boom, of which the second half drifts off at 0.3 m/s in +y."""

    def _pose(self, body):
        return super()._pose(body) + (0.3 * self.time * (body in BODIES[6:])) * np.eye(7)[1]


def loss_rate(pools):
    """A closure for this test: a hundredth of the pool a second for each m/s above 0.1 m/s."""
    return {LossCause.ENTRAINMENT: 0.01 * np.maximum(pools.normal_speed - 0.1, 0.0) * pools.volume}


def build(speed: float = 0.5, connected: bool = True, tow: type[TowedBoom] = TowedBoom) -> tuple[CoSimulation, Slick]:
    """A run with 2 m3 of oil, in water that flows at 0.1 m/s in -y."""
    half = 2.0 * np.array([np.cos(np.radians(60.0)), np.sin(np.radians(60.0))])
    left = [(-30.0 + 2 * half[0] * k, -2 * half[1] * k) for k in range(6, -1, -1)]
    line = [*left, *((x, -y) for x, y in reversed(left[:-1]))]
    sweep = Boom(name="sweep", nodes=line, draft=0.5)
    slick = Slick(SlickSettings(loss_volume=0.002, diffusivity=0.02, seed=1), [sweep])
    oil = Oil(density=875.0, dynamic_viscosity=0.02, interfacial_tension=0.02)
    slick.release(oil, 2.0, count=400, center=(0.0, 3.0), radius=10.0, age=300.0)
    booms = [BoomBodies(name="sweep", bodies=BODIES, **SECTION)]
    participant = SlickParticipant(
        "slick", slick, CarryingSea(UniformFlow((0.0, -0.05))), booms=booms, loss_rate=loss_rate
    )
    assert participant.bodies == tuple(BODIES)
    links = [Connection("tow", "poses", "slick", "poses")] if connected else []
    return CoSimulation([tow(speed), participant], links, STEP, rolls_back=True), slick


def outputs(run: CoSimulation) -> dict[str, np.ndarray]:
    return {name: np.array(value) for name, value in run.outputs("slick").items()}


def test_towed_boom_gathers_and_loses_oil():
    """The outputs close the account at every point; the boom holds most, loses some by the closure's cause."""
    run, _ = build()
    run.initialize()
    assert not run.rollback_faults
    for _ in range(400):
        run.step()
        now = outputs(run)
        assert sum(now[name] for name in ("afloat", "contained", "lost", "stranded", "recovered")) == pytest.approx(
            2.0, abs=1e-12
        )
    assert now["contained"] > 0.8
    assert now["sweep.contained"] == pytest.approx(now["contained"], rel=1e-12)
    assert now["sweep.held_by_segment"].sum() == pytest.approx(now["contained"], rel=1e-12)
    assert now["sweep.passed.entrainment"] > 0.02
    assert now["lost.entrainment"] == pytest.approx(now["sweep.passed.entrainment"], rel=0.2)
    assert np.allclose(now["sweep.draft"], 0.4)
    assert np.allclose(now["sweep.freeboard"], 0.35) and np.allclose(now["sweep.lean"], 0.0)
    expected = 0.5 * np.cos(np.radians(30.0)) + np.array([1.0] * 6 + [-1.0] * 6) * 0.05 * np.sin(np.radians(30.0))
    assert np.allclose(now["sweep.normal_speed"], expected, atol=1e-9)
    middle = 5
    assert now["sweep.thickness"][middle : middle + 2].max() > now["sweep.thickness"][[0, 11]].max()
    run.terminate()


def test_restored_run_repeats_bit_for_bit():
    run, _ = build()
    run.initialize()
    run.run(30.0)
    saved = run.save_state()
    run.run(50.0)
    first = outputs(run)
    run.restore_state(saved)
    run.run(50.0)
    again = outputs(run)
    assert all(np.array_equal(first[name], again[name]) for name in first)
    run.terminate()


def test_a_parted_boom_ends_at_its_own_joints_and_loses_oil_between_them():
    """Each segment keeps its length of 4 m; the opening grows to 60 m, and all of the oil that comes to it passes there."""
    run, slick = build(tow=PartingBoom)
    slick.part("sweep", 6)
    run.initialize()
    assert not run.rollback_faults
    run.run(200.0)
    rows, now = slick.barriers.rows("sweep"), outputs(run)
    assert np.allclose(slick.barriers.lengths()[rows], 4.0)
    assert np.allclose(slick.barriers.start[6] - slick.barriers.end[5], (0.0, 60.0))
    assert now["sweep.passed.through"] > 1.0
    assert now["sweep.contained"] < 0.3
    run.terminate()


def test_bodies_without_a_connection_or_an_orientation_are_told():
    run, _ = build(connected=False)
    with pytest.raises(CoSimulationError, match=r"the input 'poses' is not set"):
        run.initialize()
    poses = np.zeros((1, 7))
    slick = Slick(SlickSettings(loss_volume=0.01), [Boom(name="sweep", nodes=[(-2.0, 0.0), (2.0, 0.0)], draft=0.4)])
    bodies = [BoomBodies(name="sweep", bodies=["segment-0"], **SECTION)]
    with pytest.raises(ValueError, match="the pose of 'segment-0' has the quaternion 0"):
        SlickParticipant("slick", slick, CarryingSea(UniformFlow()), booms=bodies).set("poses", poses)


def test_boom_with_another_number_of_bodies_is_refused():
    _, slick = build()
    short = BoomBodies(name="sweep", bodies=BODIES[:4], **SECTION)
    with pytest.raises(ValueError, match="boom 'sweep' has 4 bodies, allowed: 12"):
        SlickParticipant("slick", slick, CarryingSea(UniformFlow()), booms=[short])


def test_a_leaning_boom_in_a_sea_tells_lean_draft_and_freeboard_from_the_local_surface():
    class Swell:
        """A surface 0.1 m above its still level of 0.2 m, without a tide."""

        level = 0.2

        def rise(self, time):
            return 0.0

        def elevation(self, xy, time):
            return np.full(len(xy), 0.3)

    slick = Slick(SlickSettings(loss_volume=0.01), [Boom(name="sweep", nodes=[(-2.0, 0.0), (2.0, 0.0)], draft=0.4)])
    bodies = [BoomBodies(name="sweep", bodies=["segment-0"], **SECTION)]
    participant = SlickParticipant("slick", slick, CarryingSea(UniformFlow(), surface=Swell()), booms=bodies)
    lean = np.radians(30.0)
    participant.enter_initialization_mode(0.0)
    participant.set("poses", np.array([[0.0, 0.0, 0.0, np.sin(0.5 * lean), 0.0, 0.0, np.cos(0.5 * lean)]]))
    participant.exit_initialization_mode()
    assert participant.get("sweep.lean") == pytest.approx([lean])
    assert participant.get("sweep.draft") == pytest.approx([0.3 + 0.45 * np.cos(lean)])
    assert participant.get("sweep.freeboard") == pytest.approx([0.3 * np.cos(lean) - 0.3])
    assert not slick.barriers.is_submerged.any()  # the top at 0.26 m is above the still water


class Tide:
    """A still sea whose level changes by a rate [m/s]."""

    level = 0.0

    def __init__(self, rate: float) -> None:
        self.rate = rate

    def rise(self, time):
        return self.rate * time

    def elevation(self, xy, time):
        return np.full(len(xy), self.rise(time))


@pytest.mark.parametrize("rate", [-0.01, 0.01])
def test_oil_poured_on_a_beach_lies_at_its_waterline_as_the_tide_moves_that(rate):
    """A waterline that runs 0.2 m/s out or in never leaves poured oil on land, unless it sticks there."""
    beach = Beach(waterline=(0.0, 0.0, 0.0), seaward=-0.5 * np.pi, slope=0.05, width=100.0, capacity=0.0001)
    shore = Outline(name=beach.name, nodes=beach.outline(0.0), capacity=beach.capacity, carries=False)
    slick = Slick(SlickSettings(loss_volume=0.002, seed=1), [shore])
    participant = SlickParticipant(
        "slick", slick, CarryingSea(UniformFlow((0.0, -0.01)), None, Tide(rate)), beach=beach
    )
    oil = Oil(density=875.0, dynamic_viscosity=0.02, interfacial_tension=0.02)
    participant.sources.append(SpillSource("leak", oil, (-20.0, 10.0), 0.1, 0.001))
    run = CoSimulation([participant], [], STEP)
    run.initialize()
    for _ in range(120):
        run.step()
        afloat = slick.parcels.state == ParcelState.AFLOAT
        assert not slick.barriers.encloses(slick.parcels.position[afloat]).any()
    assert slick.oil.spilled == pytest.approx(0.030)
    assert (np.abs(slick.parcels.position[:, 0] + 20.0) < 6.0).all()
    assert (slick.oil.stranded > 0.0) == (rate < 0.0)
