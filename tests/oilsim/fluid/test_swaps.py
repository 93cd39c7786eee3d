"""Particles that change places: what they are moves, and volume, mass and momentum stay; and particles that change their liquid."""

import numpy as np
import pytest

from oilsim import Fluid, FluidConfig, Phase, block, tank_walls

SPACING = 0.1
DENSITIES = {"water": 1000.0, "oil": 850.0}


def layers(**settings):
    """Oil on water in a box that has no walls, with a shear."""
    phases = tuple(Phase(name=name, rest_density=rho) for name, rho in DENSITIES.items())
    config = FluidConfig(
        particle_spacing=SPACING, phases=phases, lower=(-1.0, -1.0, -1.0), upper=(2.0, 2.0, 2.0), gravity=(0.0, 0.0, -1.0),
        maximum_time_step=0.005, **settings,
    )  # fmt: skip
    fluid = Fluid(config, threads=1)
    for phase, low, high in (("water", 0.0, 0.4), ("oil", 0.4, 0.6)):
        points = block((0.0, 0.0, low), (0.6, 0.6, high), SPACING)
        fluid.add_particles(points, phase=phase, velocity=np.outer(points[:, 2], [1.0, 0.0, 0.3]))
    return fluid


def pair(fluid):
    """The first oil particle, and the last of the water."""
    return int(fluid.phase_ids("oil")[0]), int(fluid.phase_ids("water")[-1])


def place_of(fluid, particle):
    return fluid.particles.position[:, fluid.particles.id == particle][:, 0]


def test_what_a_particle_is_changes_place_and_nothing_is_lost():
    fluid = layers()
    oil, water = pair(fluid)
    before = {name: fluid.phase_ids(name) for name in DENSITIES}
    places, momentum = (place_of(fluid, oil).copy(), place_of(fluid, water).copy()), fluid.momentum()
    fluid.swap_particles([oil], [water])
    assert np.array_equal(place_of(fluid, oil), places[1])
    assert np.array_equal(place_of(fluid, water), places[0])
    for name, ids in before.items():
        assert np.array_equal(fluid.phase_ids(name), ids)
    assert fluid.momentum() == pytest.approx(momentum, rel=1e-7, abs=1e-7 * np.abs(momentum).max())


def test_a_step_after_a_swap_is_that_of_a_restored_state():
    """With neighbour lists that were kept over steps, and that no longer fit."""
    first = layers()
    for _ in range(3):
        first.advance(0.005)
    first.swap_particles(*[[one] for one in pair(first)])
    second = layers()
    second.restore_state(first.save_state())
    for fluid in (first, second):
        fluid.advance(0.01)
    assert np.array_equal(first.particles.position, second.particles.position)
    assert np.array_equal(first.particles.id, second.particles.id)


def test_accounts_book_the_swap():
    fluid = layers()
    budget = fluid.watch()
    fluid.advance(0.005)
    oil, water = pair(fluid)
    rise = place_of(fluid, oil)[2] - place_of(fluid, water)[2]
    fluid.swap_particles([oil], [water])
    fluid.advance(0.005)
    swaps = budget.last.part("swaps")
    lifted = (DENSITIES["water"] - DENSITIES["oil"]) * SPACING**3 * 1.0 * rise
    assert swaps.potential == pytest.approx(lifted, rel=1e-5)
    assert np.abs(swaps.momentum[:3]).max() < 1e-6 * np.abs(fluid.momentum()).max()
    assert budget.last.energy_residual < 1e-5
    assert budget.last.momentum_residual < 1e-5


def test_a_swap_wakes_sleeping_liquid():
    fluid = layers(sleep_speed=10.0)
    fluid.add_boundary(tank_walls((0.0, 0.0, 0.0), (0.6, 0.6, 0.8), SPACING, sides=("-x", "+x", "-y", "+y", "-z")))
    fluid.set_velocities(np.zeros((3, fluid.particle_count)))
    for _ in range(100):
        if fluid.advance(0.1).asleep:
            break
    assert fluid.particles.asleep
    fluid.swap_particles(*[[one] for one in pair(fluid)])
    assert fluid.advance(0.005).asleep == 0


def test_bad_pairs_are_refused():
    fluid = layers()
    oil, water = pair(fluid)
    with pytest.raises(ValueError, match="particle 99999 does not exist"):
        fluid.swap_particles([oil], [99999])
    with pytest.raises(ValueError, match="each particle once"):
        fluid.swap_particles([oil, oil], [water, 0])
    with pytest.raises(ValueError, match="1 first and 2 second"):
        fluid.swap_particles([oil], [water, 0])


def test_a_change_of_liquid_books_its_mass_and_moves_nothing():
    """n water particles become oil: n V delta-rho is gone, with its momentum and its energy, and the accounts close."""
    fluid = layers()
    budget = fluid.watch()
    fluid.advance(0.005)
    fluid.finish_step()
    chosen, others = fluid.phase_ids("water")[:7], fluid.phase_ids("water")[7:]
    known, oil_before = fluid.particles.id.copy(), fluid.phase_ids("oil")
    rows = np.isin(fluid.particles.id, chosen)
    before = {name: getattr(fluid.particles, name).copy() for name in ("position", "velocity")}
    place, speed = (before[name][:, rows].astype(float) for name in ("position", "velocity"))
    fresh = fluid.change_phase(chosen, "oil")
    for name, values in before.items():
        assert np.array_equal(getattr(fluid.particles, name), values)
    assert np.unique(fresh).size == 7 and not np.isin(fresh, known).any()
    assert np.array_equal(np.sort(fluid.phase_ids("oil")), np.sort([*oil_before, *fresh]))
    assert np.array_equal(np.sort(fluid.phase_ids("water")), np.sort(others))
    assert np.array_equal(np.sort(fluid.particles.id[rows]), np.sort(fresh))
    fluid.advance(0.005)
    swaps, less = budget.last.part("swaps"), (DENSITIES["oil"] - DENSITIES["water"]) * SPACING**3
    assert swaps.momentum[:3] == pytest.approx(less * speed.sum(axis=1), rel=1e-5, abs=1e-6)
    assert swaps.potential == pytest.approx(less * 1.0 * place[2].sum(), rel=1e-5)
    assert swaps.kinetic == pytest.approx(0.5 * less * (speed**2).sum(), rel=1e-5)
    assert budget.last.energy_residual < 1e-5
    assert budget.last.momentum_residual < 1e-5


def test_a_change_of_liquid_refuses_what_it_cannot_change():
    fluid = layers()
    oil, water = pair(fluid)
    for ids, message in (([water, 99999], "particle 99999 does not exist"), ([water, oil, water], "particle twice")):
        with pytest.raises(ValueError, match=message):
            fluid.change_phase(ids, "oil")
    with pytest.raises(ValueError, match="brine"):
        fluid.change_phase([water], "brine")
    assert pair(fluid) == (oil, water)


def drop_that_leaves():
    """Oil on water, beside a drop that has flown out of the domain in a step that goes on; the fluid, and the drop's id."""
    fluid = layers()
    fluid.add_particles([(1.8, 0.3, 0.3)], phase="oil", velocity=(10.0, 0.0, 0.0))
    drop = int(fluid.particles.id.max())
    while drop in fluid.particles.id:
        fluid.advance(1.1e-3)
        if fluid.state.time_left > 0.0 and place_of(fluid, drop)[0] > 2.0:
            return fluid, drop
    raise AssertionError("it left at the end of a step")


@pytest.mark.parametrize("change", ["swap", "phase"])
def test_a_particle_that_leaves_by_a_change_is_no_other_one(change):
    fluid, drop = drop_that_leaves()
    before = {name: fluid.phase_ids(name) for name in DENSITIES}
    with pytest.raises(ValueError, match=f"particle {drop} does not exist, allowed: ids of particles in the fluid"):
        if change == "swap":
            fluid.swap_particles([drop], [int(before["water"][0])])
        else:
            fluid.change_phase([drop], "water")
    assert np.array_equal(fluid.phase_ids("water"), before["water"])
    assert np.array_equal(fluid.phase_ids("oil"), before["oil"][before["oil"] != drop])
