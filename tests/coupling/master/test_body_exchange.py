"""Bodies far lighter than the water they displace: the lagged exchange blows up, the other three carry them up and afloat."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import trimesh

from coupling.bullet.assembly import ExchangeOptions
from coupling.master.algorithms import Aitken, Iteration, QuasiNewton
from coupling.master.body_exchange import BodyExchange, BodyInterface, Scheme, stability_number
from coupling.master.connection import Link
from coupling.master.errors import CoSimulationError
from coupling.master.exchange_ledger import ENERGY_LIMIT
from coupling.participants.fluid import added_mass
from coupling.solids.bodies import box, cylinder, sphere
from coupling.solids.surface_sampling import boundary_particles
from coupling.testkit import TankScene, tank
from oilsim import solid_box

WATER, GRAVITY, STEP = 1000.0, 9.81, 0.01
SIDE, SPACING = 0.2, 0.05


def raft_under_water(
    density: float, scheme: Scheme | None, iteration: type = Aitken, energy_limit: float = ENERGY_LIMIT
) -> TankScene:
    """A cube in the middle of a small tank, held under and let go."""
    options = ExchangeOptions(scheme=scheme, iteration=iteration, energy_limit=energy_limit)
    scene = tank(size=(0.5, 0.5, 0.6), depth=0.3, particle_spacing=SPACING, exchange=options)
    scene.add_body("raft", box((SIDE, SIDE, SIDE)), density=density, position=(0.25, 0.25, 0.15))
    return scene


def accelerations(scene: TankScene, steps: int) -> np.ndarray:
    """Changes of the velocity (steps, 3) over H, in g."""
    speeds = [scene.world.twist("raft")[:3]]
    for _ in range(steps):
        scene.step()
        speeds.append(scene.world.twist("raft")[:3])
    return np.diff(speeds, axis=0) / (STEP * GRAVITY)


@pytest.mark.slow
def test_lagged_exchange_blows_up() -> None:
    # without the added mass ma the release acceleration is (1 - s) / s = 9 g, with it (1 - s) / (s + Ca) < 2 g. Then errors
    # grow by ma / m a step, to many times what gravity or buoyancy could do
    with raft_under_water(0.1 * WATER, Scheme.EXPLICIT) as scene:
        found = accelerations(scene, 2)
        assert found[0, 2] == pytest.approx(9.0, rel=0.1)
        # the ledger sees it at once: the exchange makes energy
        with pytest.raises(
            CoSimulationError, match=r"'bodies' failed at .*: body 'raft': the exchange has created .* unstable"
        ):
            accelerations(scene, 20)
    with raft_under_water(0.1 * WATER, Scheme.EXPLICIT, energy_limit=math.inf) as scene:
        assert np.abs(accelerations(scene, 12)).max() > 5.0 * 9.0


def test_impulse_that_is_lost_on_the_way_ends_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    carried = Link.carried
    monkeypatch.setattr(Link, "carried", lambda link, value: carried(link, value) * (1.0 + 1e-5))
    with (
        raft_under_water(0.1 * WATER, Scheme.VIRTUAL_MASS) as scene,
        pytest.raises(
            CoSimulationError,
            match=r"'bodies' failed at .*: body 'raft' took an impulse of .* the fluid gave .* allowed: ",
        ),
    ):
        accelerations(scene, 2)


def forget(monkeypatch: pytest.MonkeyPatch, *told: str) -> None:
    """Interfaces of bodies do not tell these any more."""

    def silent(**terms: Any) -> BodyInterface:
        return BodyInterface(**{name: value for name, value in terms.items() if name not in told})

    monkeypatch.setattr("coupling.bullet.assembly.BodyInterface", silent)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scheme", "iteration", "is_mass_known"),
    [
        (None, Aitken, True),
        (Scheme.VIRTUAL_MASS, Aitken, True),
        (Scheme.VIRTUAL_MASS, Aitken, False),
        (Scheme.ITERATED, QuasiNewton, True),
        (Scheme.ITERATED, Aitken, False),
    ],
)
def test_every_other_scheme_carries_the_light_body_up(
    scheme: Scheme | None, iteration: type[Iteration], is_mass_known: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not is_mass_known:
        forget(monkeypatch, "mass_matrix")
    with raft_under_water(0.1 * WATER, scheme, iteration) as scene:
        found = accelerations(scene, 120)
        # nothing pulls harder than twice the release, in any direction and at any time, surfacing included
        assert np.abs(found).max() < 2.4
        # Ca of a cube is 0.67, in this tank up to twice that: (1 - 0.1) / (0.1 + Ca) = 0.6 to 1.2
        assert 0.6 < found[0, 2] < 1.2
        drafts = []
        for _ in range(60):
            scene.step()
            drafts.append(scene.draft("raft"))
        assert scene.ledger is not None and abs(scene.ledger.energy_residual) < 1e-6
        assert np.mean(drafts) == pytest.approx(0.1 * SIDE, abs=SPACING)


def test_free_bodies_move_alike_under_all_schemes(monkeypatch: pytest.MonkeyPatch) -> None:
    # what acts on them besides the liquid is gravity, which is predicted: nothing is left to iterate, or to come late
    def moved(scheme: Scheme | None) -> np.ndarray:
        with raft_under_water(0.1 * WATER, scheme) as scene:
            return accelerations(scene, 20)

    exact = moved(None)
    np.testing.assert_allclose(moved(Scheme.VIRTUAL_MASS), exact, atol=1e-6)
    np.testing.assert_allclose(moved(Scheme.ITERATED), exact, atol=1e-6)
    forget(monkeypatch, "mass_matrix")
    np.testing.assert_allclose(moved(Scheme.VIRTUAL_MASS), exact, atol=1e-4)  # differences of the measured mass


@pytest.mark.parametrize("iteration", [Aitken, QuasiNewton])
def test_iteration_finds_a_load_that_nobody_foresaw(
    iteration: type[Iteration], monkeypatch: pytest.MonkeyPatch
) -> None:
    forget(monkeypatch, "gravity")
    with raft_under_water(0.1 * WATER, Scheme.ITERATED, iteration) as scene:
        mass = scene.world.mass_matrix("raft")[0, 0]
        before = scene.world.twist("raft")[:3]
        scene.step()
        change = scene.world.twist("raft")[:3] - before
        assert 0.6 < change[2] / (STEP * GRAVITY) < 1.2
        taken = mass * (change + np.array((0.0, 0.0, GRAVITY * STEP)))
        given = STEP * scene.simulation.outputs("fluid")["raft.wrench"][:3]
        np.testing.assert_allclose(taken, given, rtol=1e-9, atol=1e-9)
        assert scene.exchange is not None and 1 < scene.exchange.iterations < 4
        assert scene.exchange.unsettled == 0


def test_iteration_bears_a_blow() -> None:
    # a heavy cube falls on the floor, which stops it within a step: no acceleration without the liquid explains that
    with tank(
        size=(0.5, 0.5, 0.6), depth=0.1, particle_spacing=SPACING, exchange=ExchangeOptions(scheme=Scheme.ITERATED)
    ) as scene:
        scene.add_body("stone", box((SIDE, SIDE, SIDE)), density=2000.0, position=(0.25, 0.25, 0.35))
        scene.run(1.0)
        assert scene.world.pose("stone")[2] == pytest.approx(0.5 * SIDE, abs=0.01)
        assert scene.ledger is not None and scene.ledger.momentum_residual < 1e-9


def test_blow_is_not_expected_to_strike_again() -> None:
    # the water's force counts until the end of the step in which a shelf stops the cube, 3 % of the energy with which it falls; the impulse
    # of the shelf, taken for a load in the next step, would make 1.2 % there, for less than 0.01
    speed = 2.0
    options = ExchangeOptions(scheme=Scheme.VIRTUAL_MASS)
    with tank(size=(0.5, 0.5, 0.6), depth=0.35, particle_spacing=SPACING, exchange=options) as scene:
        scene.world.add_half_space((0.25, 0.25, 0.5 * SIDE), (0.0, 0.0, 1.0))
        scene.add_body(
            "stone",
            box((SIDE, SIDE, SIDE)),
            density=2000.0,
            position=(0.25, 0.25, 0.437),  # from which one step stops it
            twist=(0.0, 0.0, -speed, 0.0, 0.0, 0.0),
        )
        made = []
        for _ in range(80):
            scene.step()
            assert scene.ledger is not None
            made.append(scene.ledger.unexplained)
        assert scene.world.pose("stone")[2] == pytest.approx(SIDE, abs=0.01)
        after = made[int(np.argmax(made)) + 1 :]
        assert max(after) < 2e-3 * 0.5 * 2000.0 * SIDE**3 * speed**2


def test_step_that_does_not_settle_stands_and_is_told_once(monkeypatch: pytest.MonkeyPatch) -> None:
    forget(monkeypatch, "gravity")
    monkeypatch.setattr("coupling.master.body_exchange.LARGEST_NUMBER_OF_ITERATIONS", 1)
    with raft_under_water(0.1 * WATER, Scheme.ITERATED) as scene:
        with pytest.warns(
            UserWarning, match=r"does not converge in 1 rounds at 0 s, .* acceleration error .* allowed: "
        ):
            scene.step()
        assert scene.exchange is not None and scene.exchange.unsettled == 1
        assert scene.ledger is not None and scene.ledger.momentum_residual < 1e-9


# choice of the scheme


def interface(number: float | None) -> BodyInterface:
    return BodyInterface(
        body="raft",
        fluid="fluid",
        solver="bodies",
        added_mass=lambda: np.eye(6) * (number or 1.0),
        mass_matrix=None if number is None else lambda: np.eye(6),
    )


@pytest.mark.parametrize(
    ("number", "faults", "rolled_back", "expected"),
    [
        (0.05, {}, (), Scheme.EXPLICIT),
        (3.0, {}, (), Scheme.VIRTUAL_MASS),
        (None, {}, ("fluid", "bodies"), Scheme.ITERATED),
        (None, {"fluid": "cannot save"}, ("fluid", "bodies"), Scheme.VIRTUAL_MASS),
    ],
)
def test_scheme_follows_from_the_stability_number(
    number: float | None, faults: dict, rolled_back: tuple[str, ...], expected: Scheme
) -> None:
    exchange = BodyExchange([interface(number)])
    assert exchange.prepare({}, []) == rolled_back
    told = exchange.begin(faults)
    assert exchange.schemes == {"raft": expected}
    assert told[0].startswith(
        f"coupled {expected.value}: raft (added mass / mass {'unknown' if number is None else f'{number:g}'}"
    )


def test_what_cannot_be_coupled_is_refused() -> None:
    exchange = BodyExchange([interface(None)])
    exchange.prepare({}, [])
    with pytest.raises(
        CoSimulationError, match=r"'raft' cannot be coupled .*: 'bodies' cannot be rolled back \(no state\), allowed: "
    ):
        exchange.begin({"bodies": "no state"})


def test_a_body_that_does_not_answer_is_not_solved_for_inside_the_pressure_solve() -> None:
    wished = replace(interface(3.0), scheme=Scheme.MONOLITHIC)
    with pytest.raises(
        CoSimulationError,
        match=r"'raft' cannot be coupled \(inside .*\): 'fluid' does not get its inverse mass, allowed: ",
    ):
        BodyExchange([wished]).prepare({}, [])


def test_monolithic_by_name_is_what_is_chosen_without_a_name() -> None:
    found = []
    for scheme in (None, Scheme.MONOLITHIC):
        with raft_under_water(0.1 * WATER, scheme) as scene:
            found.append(accelerations(scene, 3))
            assert scene.exchange is not None and scene.exchange.schemes == {"raft": Scheme.MONOLITHIC}
    np.testing.assert_array_equal(*found)


def test_a_scheme_that_is_none_is_refused() -> None:
    with pytest.raises(
        TypeError, match=r"scheme of body 'raft' is 'virtual mass', allowed: None, Scheme\.MONOLITHIC, "
    ):
        replace(interface(3.0), scheme="virtual mass")
    with pytest.raises(TypeError, match="scheme of the bodies is 'explicit', allowed: None, Scheme"):
        raft_under_water(0.1 * WATER, "explicit")  # type: ignore[arg-type]


# added mass


def diagonal(mesh: trimesh.Trimesh, spacing: float) -> np.ndarray:
    return np.diag(added_mass(boundary_particles("body", mesh, spacing), spacing, 3, WATER))


@pytest.mark.parametrize("spacing", [0.05, 0.03, pytest.param(0.01, marks=pytest.mark.slow)])
def test_added_mass_is_within_a_factor_of_two(spacing: float) -> None:
    # sphere 1/2 rho V, and none that turns it; cube 0.67 rho V; disc 8/3 rho a^3 across
    displaced = WATER * 4.0 / 3.0 * math.pi * 0.12**3
    ball = diagonal(sphere(0.12), spacing)
    np.testing.assert_array_less(np.abs(np.log2(ball[:3] / (0.5 * displaced))), 1.0)
    assert ball[3:].max() < 0.06 * displaced * 0.12**2
    np.testing.assert_array_less(np.abs(np.log2(diagonal(box((0.2,) * 3), spacing)[:3] / (0.67 * WATER * 0.2**3))), 1.0)
    assert abs(math.log2(diagonal(cylinder(0.15, 0.05), spacing)[2] / (8.0 / 3.0 * WATER * 0.15**3))) < 1.0


def test_added_mass_of_a_plate_in_two_dimensions() -> None:
    spacing, width = 0.01, 0.4
    plate = solid_box((width, 0.0, 0.02), spacing, dimension=2)
    # pi / 4 rho b^2 a metre
    across = added_mass(plate, spacing, 2, WATER)[2, 2]
    assert across == pytest.approx(math.pi / 4.0 * WATER * width**2, rel=0.45)


def test_stability_number_is_the_largest_ratio() -> None:
    assert stability_number(np.diag([1.0, 2.0, 3.0, 0, 0, 8.0]), np.diag([1.0, 1.0, 1.0, 1, 1, 2.0])) == pytest.approx(
        4.0
    )


# iterations


@pytest.mark.parametrize(("kind", "calls"), [(QuasiNewton, 6), (Aitken, 200)])
def test_iterations_solve_what_plain_repetition_does_not(kind: type, calls: int) -> None:
    # x = b - G x with gains up to 30, as of three bodies of small mass: the solution is (1 + G)^-1 b
    gain, constant = np.diag([30.0, 20.0, 10.0]) + 0.5, np.array([1.0, -2.0, 3.0])
    if kind is Aitken:
        gain = np.eye(3) * 30.0  # one factor for all unknowns
    x, iteration = np.zeros(3), kind(0.05)
    for _ in range(calls):
        residual = constant - gain @ x - x
        if np.abs(residual).max() < 1e-9:
            break
        x = iteration.proposal(x, residual, np.ones(3))
    np.testing.assert_allclose(x, np.linalg.solve(np.eye(3) + gain, constant), rtol=1e-8)
