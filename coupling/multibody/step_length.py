"""The length of a step of the rigid body engine: no body turns, swings or moves into another one too far, and lines are stable."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from coupling.multibody.broad_phase import BroadPhase
from coupling.multibody.joint_constraints import Articulation
from coupling.multibody.lines import Lines
from coupling.multibody.rigid_state import RigidBodyState, steady

Array = npt.NDArray[np.float64]

TURNED = (
    0.025  # [rad], largest turn; a tumbling body then gains or loses less than a thousandth of its energy in ten turns
)
TURNED_AT_SEA = (
    0.1  # [rad], largest turn of bodies that a sea loads: its damping takes far more energy than the step's error makes
)
SWUNG = 0.5  # [rad], largest swing under the forces of joints; from 2 on swings grow
SWUNG_AT_SEA = 1.0  # [rad], the same of bodies that a sea loads, whose damping takes what swings gain
CHOSEN_FOR = 2  # longest sub-steps at sea for which the sub-step is chosen at once; waves change little within them
SHORTEST = 5e-4  # [s], shortest step because of turns and swings, and of any single line when it is added


def step_rate(
    state: RigidBodyState,
    gravity: Array,
    held: Articulation | None,
    lines: Lines,
    broad_phase: BroadPhase,
    spans: tuple[float, float],
) -> float:
    """Return the steps per second that bodies, joints (`held`) and lines need now; gravity (3,) [m/s2].

    spans [s]: the longest step that is allowed anyway, and the time within which bodies may run into each other.
    """
    longest, duration = spans
    spin = np.linalg.norm(state.twist[state.is_free, 3:], axis=1)
    at_sea = state.resistance is not None
    patient = float(spin.max(initial=0.0)) / (TURNED_AT_SEA if at_sea else TURNED)
    wrench = state.wrench + state.applied_wrench + lines.present_pull(state.pose, state.twist) + state.sea_load
    if held is not None:
        free = state.accelerations_under(wrench, gravity)
        inverse_inertia = state.inverse_masses()[:, 3:, 3:] if at_sea else state.inverse_inertia()
        swung = SWUNG_AT_SEA if at_sea else SWUNG
        patient = max(patient, held.swing(free, inverse_inertia, swung / longest) / swung)
    # a resting body is not accelerated by its weight: joints and contacts last
    lasting = wrench + steady(state.earlier_reaction, state.reaction)
    later = state.twist + duration * state.accelerations_under(lasting, gravity)
    leaping = (broad_phase.rate(state.pose, twist, duration) for twist in (state.twist, later))
    stiff = 1.0 / lines.longest_step(state.pose, state.inverse_masses())
    return max(min(patient, 1.0 / SHORTEST), stiff, *leaping)
