"""The accounts of energy and momentum: each cause against its formula, nothing left over, and nothing changed by looking."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from oilsim import BoundaryParticles, Phase, PipeEmitter, block, tank_walls
from oilsim.accounts.ledger import CAUSES
from oilsim.neighborhood.smoothing_kernels import SUPPORT, kernel, normalisation
from oilsim.sea import KaimalGusts, SeaForcing, WindDrift
from tests.seas import shallow_sea

OILY = (
    Phase(name="water", rest_density=1000.0),
    Phase(name="oil", rest_density=800.0, dynamic_viscosity=5.0, adhesion=0.05),
)
WEIGHTLESS = (0.0, 0.0, 0.0)
G = 9.81


def plane_tank(make_fluid, width, depth, spacing, threads=1):
    """A column of water at the left of a plane tank 1 m wide."""
    fluid = make_fluid(threads=threads, particle_spacing=spacing, dimension=2, lower=(-0.2,) * 3, upper=(1.2, 1.2, 1.4))
    fluid.add_boundary(tank_walls((0, 0, 0), (1, 0, 1), spacing, sides=("-x", "+x", "-z"), dimension=2))
    fluid.add_particles(block((0, 0, 0), (width, 0, depth), spacing, 2), phase="water")
    return fluid


def everything(make_fluid, scheme="split"):
    """Two phases with a tension in our scheme, a drop, periodic along y, sticky no-slip walls, a pipe, wind, a body, an open side."""
    tension = {"interfacial_tension": 0.03} if scheme == "split" else {}
    fluid = make_fluid(
        phases=(OILY[0], replace(OILY[1], **tension)), lower=(-0.3, 0.0, -0.3), upper=(1.8, 1.5, 2.3), periodic=(False, True, False),
        gravity=(0.5, 0.3, -G), scheme=scheme,
    )  # fmt: skip
    walls = tank_walls((0, 0, 0), (1.5, 1.5, 1.5), 0.1, sides=("-x", "-z"), periodic=(False, True, False), no_slip=True)
    fluid.add_boundary(walls)
    fluid.add_particles(block((0, 0, 0), (1.5, 1.5, 0.6), 0.1), phase="water", velocity=(0.5, 0.4, 0.0))
    fluid.add_particles(block((0.4, 0.4, 0.7), (1.0, 1.0, 1.0), 0.1), phase="oil")
    fluid.add_particles(block((1.5, 0.0, 1.0), (1.8, 0.3, 1.2), 0.1), phase="oil", velocity=(1.0, 0.0, 0.0))
    fluid.add_particles([[0.15, 0.7, 1.4]], phase="water", velocity=(-2.0, 0.0, 0.0))  # a drop that meets a wall
    fluid.add_emitter(
        PipeEmitter(phase="oil", mouth=(0.2, 0.2, 1.2), direction=(0, 0, -1), radius=0.1, speed=0.5, spacing=0.1)
    )
    fluid.add_forcing(
        SeaForcing(
            shallow_sea(0.6, wind=(7.6, 2.4), gusts=KaimalGusts(intensity=0.3, seed=5), drift=WindDrift()), spacing=0.1
        )
    )
    handle = fluid.add_boundary(solid_cube(no_slip=True))
    fluid.set_boundary_motion(handle, (0.7, 0.7, 1.2), (0, 0, 0, 1), (0.0, 0.0, -1.0), (0.0, 0.5, 0.0))
    return fluid


def solid_cube(no_slip=False):
    """A cube of 0.3 m, filled with wall particles a spacing of 0.1 m apart, about its centre of mass."""
    points = block((-0.15,) * 3, (0.15,) * 3, 0.1)
    return BoundaryParticles(
        name="cube", position=points, volume=np.full(27, 1e-3), area=np.full(27, 1e-2), no_slip=no_slip
    )


def flying_at_a_cube(make_fluid, **motion):
    """A block of water that flies at a cube in free space; the fluid, watched, and the cube's handle."""
    fluid = make_fluid(gravity=WEIGHTLESS, lower=(-3.0,) * 3, upper=(3.0,) * 3)
    fluid.add_particles(block((-0.7, -0.25, -0.2), (-0.2, 0.25, 0.2), 0.1), phase="water", velocity=(2.0, 0.3, 0.0))
    handle = fluid.add_boundary(solid_cube())
    fluid.set_boundary_motion(handle, (0.0, 0.05, 0.0), (0, 0, 0, 1), **motion)
    fluid.watch()
    return fluid, handle


def lattice_rate(k):
    """The viscous pair force for v_x = sin k z on a square lattice of spacing 1, sum f x^2 (1 - cos k z) / k^2, f = 16 W / sum W r^4."""
    x, z = (axis.ravel() for axis in np.meshgrid(np.arange(-3, 4), np.arange(-3, 4)))
    r = np.hypot(x, z)
    weight = kernel(r / SUPPORT, normalisation(1.0, 2))
    pairs = 16.0 * weight / (weight * r**4).sum() * x**2 * (1.0 - np.cos(k * z))
    return float(pairs.sum()) / k**2


def energy_of_all(ledger):
    return sum(part.energy for part in ledger.parts.values())


def test_gravity_gives_a_falling_block_its_kinetic_energy(make_fluid):
    fluid = make_fluid()
    fluid.add_particles(block((0.5, 0.5, 1.2), (1.0, 1.0, 1.7), 0.1), phase="water")
    budget = fluid.watch()
    step, steps, mass = 0.01, 20, 125.0
    for _ in range(steps):
        fluid.advance(step)
    ledger, time = budget.total, step * steps
    gravity = ledger.part("gravity")
    assert ledger.duration == pytest.approx(time)
    assert gravity.kinetic == pytest.approx(0.5 * mass * (G * time) ** 2, rel=1e-5)
    assert gravity.kinetic == pytest.approx(ledger.change.kinetic, rel=1e-6)
    # positions move by the velocities before the kick: they lag by g dt t / 2, which is the error of time stepping
    assert ledger.gravity_work == pytest.approx(0.5 * mass * G**2 * time * (time - step), rel=1e-5)
    assert gravity.momentum[:3] == pytest.approx([0.0, 0.0, -mass * G * time], rel=1e-5)
    assert ledger.energy_residual < 1e-6
    # a block that falls as one meets only the round-off of its velocity gradients
    assert abs(ledger.numerical_dissipation) < 1e-7 * ledger.change.kinetic


def test_viscosity_takes_what_a_shear_wave_loses(make_fluid):
    particles, speed, viscosity, step = 24, 1e-3, 0.05, 0.01
    thick = Phase(name="water", rest_density=1000.0, dynamic_viscosity=1000.0 * viscosity)
    fluid = make_fluid(
        particle_spacing=1.0 / particles, phases=(thick,), dimension=2, lower=(0, -0.5, 0), upper=(1, 0.5, 1),
        gravity=WEIGHTLESS, periodic=(True, False, True), viscosity_tolerance=1e-5,
    )  # fmt: skip
    points = block((0, 0, 0), (1, 0, 1), 1.0 / particles, 2)
    velocity = speed * np.sin(2 * np.pi * points[:, 2])[:, None] * np.array([1.0, 0.0, 0.0])
    fluid.add_particles(points, phase="water", velocity=velocity)
    before = fluid.energy().kinetic
    fluid.watch()
    ledger = fluid.advance(step).budget
    assert ledger.viscous_dissipation == pytest.approx(before - fluid.energy().kinetic, rel=0.01)
    # the wave keeps exp(-c nu k^2 dt) of its speed, c the operator's own constant along the axes of a lattice
    kept = np.exp(-lattice_rate(2 * np.pi / particles) * viscosity * 4 * np.pi**2 * step)
    assert before == pytest.approx(1000.0 * speed**2 / 4, rel=1e-6)
    assert ledger.viscous_dissipation == pytest.approx(before * (1 - kept**2), rel=0.01)
    assert ledger.energy_residual < 1e-6
    # rho 2 S:S is rho (U k)^2 / 2 in the mean; gradients over a support that spans 0.7 rad are good to 5 %
    assert ledger.strain == pytest.approx(1000.0 * (2 * np.pi * speed) ** 2 / 2 * step, rel=0.05)
    assert abs(ledger.numerical_dissipation) < 0.01 * ledger.viscous_dissipation


def test_nothing_happens_in_still_water(make_fluid):
    fluid = plane_tank(make_fluid, 1.0, 0.5, 0.05)
    budget = fluid.watch()
    for _ in range(50):
        fluid.advance(0.01)
    ledger, weight = budget.total, 1000.0 * G * 0.5
    # particles settle by a part of a spacing, of which ten span the depth
    for cause, part in ledger.parts.items():
        assert abs(part.energy) < 0.02 * ledger.energy.potential, cause
        assert abs(part.kinetic) < 0.02 * ledger.energy.potential, cause
    assert ledger.energy.kinetic < 1e-3 * ledger.energy.potential
    assert ledger.part("gravity").momentum[2] == pytest.approx(-weight * 0.5, rel=1e-6)
    assert ledger.wall_impulse[2] == pytest.approx(weight * 0.5, rel=0.01)
    assert ledger.energy_residual < 1e-6
    assert ledger.momentum_residual < 1e-6
    assert 0 < ledger.compression.near_surface < fluid.particle_count
    assert ledger.compression.least < ledger.compression.mean < ledger.compression.largest


def test_parts_of_a_dam_break_add_up(make_fluid):
    fluid = plane_tank(make_fluid, 0.4, 0.5, 0.05)
    budget = fluid.watch()
    start = sum(fluid.energy())
    for _ in range(20):
        fluid.advance(0.01)
    ledger = budget.total
    change = sum(fluid.energy()) - start
    assert sum(ledger.energy) == pytest.approx(sum(fluid.energy()), rel=1e-9)
    assert energy_of_all(ledger) == pytest.approx(change, rel=1e-6)
    assert ledger.momentum[:3] == pytest.approx(fluid.momentum(), rel=1e-6)
    assert ledger.energy_residual < 1e-9
    assert ledger.momentum_residual < 1e-9
    assert ledger.gravity_work > 100.0
    # of a pair filter linear momentum feels nothing
    assert np.abs(ledger.part("smoothing").momentum[:3]).max() < 1e-6 * np.abs(ledger.momentum).max()
    assert budget.last.duration == pytest.approx(0.01)


def test_free_body_gains_what_the_water_gives(make_fluid):
    mass, inertia = 5.4, 5.4 * 0.3**2 / 6
    inverse = np.diag([1 / mass] * 3 + [1 / inertia] * 3)
    fluid, handle = flying_at_a_cube(
        make_fluid, linear_velocity=(0, 0, 0), angular_velocity=(0, 0, 0), inverse_mass=inverse
    )
    scale, first = np.abs(fluid.momentum()).max(), fluid.momentum()
    for _ in range(20):
        fluid.advance(0.01)
    ledger, twist = fluid.clock.budget.total, fluid.boundary_motion(handle).twist
    pressed = ledger.part("pressure")
    assert twist[0] > 0.5
    # a body under impulses alone: M V is what it received, V M V / 2 the work done on it
    assert ledger.part(*ledger.parts).impulse_on_bodies[:3] == pytest.approx(mass * twist[:3], abs=1e-6 * scale)
    gained = 0.5 * mass * twist[:3] @ twist[:3] + 0.5 * inertia * twist[3:] @ twist[3:]
    assert ledger.part(*ledger.parts).work_on_bodies == pytest.approx(gained, rel=1e-6)
    assert ledger.momentum[:3] + mass * twist[:3] == pytest.approx(first, abs=1e-6 * scale)
    assert ledger.wall_impulse[:3] == pytest.approx(0.0, abs=1e-6 * scale)
    # angular momentum: only pairs with exact gradients are not central
    assert ledger.wall_impulse[3:] == pytest.approx(0.0, abs=1e-2 * scale)
    assert pressed.kinetic + pressed.work_on_bodies <= 0.0
    assert ledger.energy_residual < 1e-6


def test_work_on_a_driven_body_is_wrench_times_twist(make_fluid):
    twist = np.array([-1.0, 0.2, 0.0, 0.0, 0.5, 1.0])
    fluid, handle = flying_at_a_cube(make_fluid, linear_velocity=twist[:3], angular_velocity=twist[3:])
    for _ in range(12):
        ledger = fluid.advance(0.01).budget
        work = fluid.boundary_wrench(handle) @ twist * 0.01
        assert ledger.part(*ledger.parts).work_on_bodies == pytest.approx(work, rel=1e-6, abs=1e-12)
    total = fluid.clock.budget.total
    assert total.part("pressure").work_on_bodies < -1.0
    scale = np.abs(total.momentum).max()
    assert total.change.momentum[:3] + total.part(*CAUSES).impulse_on_bodies[:3] == pytest.approx(0.0, abs=1e-6 * scale)


@pytest.mark.parametrize("scheme", ["split", "paper"])
def test_nothing_is_left_over_where_all_causes_act(make_fluid, scheme):
    fluid = everything(make_fluid, scheme)
    fluid.watch()
    for step in range(20):
        if step == 10:
            fluid.swap_particles([fluid.phase_ids("oil")[0]], [fluid.phase_ids("water")[0]])
        ledger = fluid.advance(0.01).budget
        assert ledger.energy_residual < 1e-6
        assert ledger.momentum_residual < 1e-6
    total = fluid.clock.budget.total
    # space repeats: nothing is turned; what forcings drive does not sleep
    expected = set(CAUSES) - {"rotation", "sleep"} - ({"smoothing", "tension"} if scheme == "paper" else set())
    assert set(total.parts) == expected
    for cause in expected:
        part = total.part(cause)
        assert abs(part.kinetic) + abs(part.potential) > 0.0, cause


def test_what_enters_and_leaves_is_counted(make_fluid):
    fluid = make_fluid(gravity=(0.0, 0.0, -1.0))
    fluid.add_particles(block((1.6, 0.5, 0.5), (1.9, 0.8, 0.8), 0.1), phase="water", velocity=(1.0, 0.0, 0.0))
    fluid.add_emitter(
        PipeEmitter(phase="water", mouth=(0.5, 1.0, 1.0), direction=(1, 0, 0), radius=0.1, speed=0.5, spacing=0.1)
    )
    budget = fluid.watch()
    reports = [fluid.advance(0.02) for _ in range(25)]
    entered = sum(report.emitted.get("water", 0) for report in reports)
    assert sum(report.removed.get("water", 0) for report in reports) == 27
    assert budget.total.part("outflow").momentum[0] == pytest.approx(-27.0, rel=1e-3)
    assert budget.total.part("outflow").kinetic < -13.5
    assert budget.total.part("emitters").momentum[0] == pytest.approx(0.5 * entered, rel=0.1)
    assert budget.total.part("emitters").potential == pytest.approx(1.0 * entered, rel=1e-3)
    assert budget.total.energy_residual < 1e-6


@pytest.mark.parametrize("scheme", ["split", "paper"])
def test_watching_does_not_change_a_bit(make_fluid, scheme):
    states = []
    for watched in (False, True):
        fluid = everything(make_fluid, scheme)
        if watched:
            fluid.watch()
        reports = [fluid.advance(0.01) for _ in range(10)]
        assert all((report.budget is not None) == watched for report in reports)
        states.append(fluid.save_state()["state"])
    for name in ("position", "velocity", "pressure_impulse", "id", "phase"):
        assert np.array_equal(states[0][name], states[1][name]), name


def test_threads_do_not_change_the_accounts(make_fluid):
    ledgers = []
    for threads in (1, 2):
        fluid = plane_tank(make_fluid, 0.64, 0.96, 0.01, threads)
        budget = fluid.watch()
        assert fluid.particle_count > 4096
        for _ in range(2):
            fluid.advance(0.002)
        ledgers.append(budget.total)
    assert ledgers[0].energy == ledgers[1].energy
    assert ledgers[0].strain == ledgers[1].strain
    for cause, part in ledgers[0].parts.items():
        other = ledgers[1].parts[cause]
        assert (part.kinetic, part.potential) == (other.kinetic, other.potential), cause
        assert np.array_equal(part.momentum, other.momentum), cause


def test_numerical_viscosity_is_that_of_a_decaying_vortex(make_fluid):
    fluid = make_fluid(
        particle_spacing=1 / 24, dimension=2, lower=(0, -0.5, 0), upper=(1, 0.5, 1), gravity=WEIGHTLESS,
        periodic=(True, False, True),
    )  # fmt: skip
    points, k = block((0, 0, 0), (1, 0, 1), 1 / 24, 2), 2 * np.pi
    x, z = k * points[:, 0], k * points[:, 2]
    velocity = np.stack([np.sin(x) * np.cos(z), np.zeros_like(x), -np.cos(x) * np.sin(z)], axis=1)
    fluid.add_particles(points, phase="water", velocity=velocity)
    fluid.advance(0.5)  # in which the lattice melts
    budget, first = fluid.watch(), fluid.energy().kinetic
    for _ in range(150):
        fluid.advance(0.01)
    # Taylor and Green: the energy decays as exp(-4 nu k^2 t); the ledger's S holds noise and errors of gradients, 2 % here
    expected = -np.log(budget.total.energy.kinetic / first) / (4 * k**2 * 1.5)
    assert budget.total.numerical_viscosity == pytest.approx(expected, rel=0.1)


def test_steps_that_end_between_advances_are_accounted_for(make_fluid):
    fluid = plane_tank(make_fluid, 0.5, 0.5, 0.05)
    fluid.advance(0.01)
    budget = fluid.watch()
    begin, poured = sum(fluid.energy()), 0.0
    for n in range(12):
        fluid.advance(0.007)
        before = sum(fluid.energy())
        fluid.finish_step()
        poured -= sum(fluid.energy())
        fluid.add_particles([(0.7, 0.0, 0.5 + 0.05 * n)], phase="water")
        poured += sum(fluid.energy())
        assert before != sum(fluid.energy())
    fluid.advance(0.007)
    assert budget.total.change.energy == pytest.approx(sum(fluid.energy()) - begin - poured, abs=1e-9)
    assert budget.total.energy_residual < 1e-9


def test_a_watched_fluid_may_be_another_in_mid_flight(make_fluid):
    def dam():
        fluid = plane_tank(make_fluid, 0.5, 0.5, 0.05)
        fluid.advance(0.104)
        return fluid

    first = dam()
    assert first.state.time_left > 0.0
    saved = first.save_state()
    first.watch()
    first.add_particles([(0.7, 0.0, 0.5)], phase="water")
    first.advance(0.05)
    for watched in (first, plane_tank(make_fluid, 0.2, 0.2, 0.05)):
        budget = watched.watch()
        watched.restore_state(saved)
        watched.advance(0.5 * watched.state.time_left)
        for _ in range(5):
            assert watched.advance(0.01).budget.energy_residual < 1e-9
        assert budget.total.part("gravity").energy != 0.0


@pytest.mark.parametrize("change", ["velocities", "particles"])
def test_what_a_program_changes_in_a_flight_is_nobodys_work(make_fluid, change):
    fluid = plane_tank(make_fluid, 0.5, 0.5, 0.05)
    fluid.watch()
    for _ in range(10):
        fluid.advance(0.01)
    fluid.advance(1e-3)
    while fluid.state.time_left < 2e-3:
        fluid.advance(1.7e-3)
    if change == "velocities":
        fluid.set_velocities(np.tile([[0.5], [0.0], [0.0]], fluid.particle_count))
    else:
        fluid.remove_particles(np.arange(fluid.particle_count) < 30)
    fluid.finish_step()
    ledger = fluid.advance(0.02).budget
    assert ledger.energy_residual < 1e-6
    assert ledger.momentum_residual < 1e-6
