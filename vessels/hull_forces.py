"""Forces of water on a hull under way, beyond those of its strips: steering derivatives, and the resistance of waves and of speed.

The strips (`vessels.loads`) carry buoyancy, added mass, cross-flow drag, wind, and friction at a speed of 1 m/s. Added here, along the
body's axes (x ahead, y to port, N counter-clockwise), with u, v the speed through the water and r the rate of turn:

    X = -R_w(u) - (F(u) - F(1 m/s)) + (c m_y - m_x) v r,   F = rho / 2 (1 + k) C_F S abs(u) u    ITTC 1957 with the form factor
    Y = rho / 2 L^2 (Y'_v abs(u) v + Y'_r L u r) + m_y u r,   N = rho / 2 L^3 (N'_v u v + N'_r L abs(u) r)

These are the linear terms of a manoeuvring model; the strips' cross-flow drag stands for its cubic ones, and rules at large drift
angles and at rest, where the linear terms vanish with u. The solver multiplies the strips' added mass m_x, m_y with the acceleration in
the world, dv/dt + omega x v; a turning added mass has omega x (A v) instead. The terms with m_x and m_y put that right, Y'_r and N'_v
hold the rest (Munk moment); c = 0.5 takes the hull's X_vr into it (Inoue, Hirano and Kijima 1981: 0.5 to 0.75). A skeg of area A_s at
x_s = -0.4 L adds the lift of a short fin, Y_s = -rho / 2 A_s C abs(u) (v + x_s r) and N_s = x_s Y_s, C = 6.13 / 3.25 (Fujii's slope of an
aspect ratio of 1).

Source of the derivatives: Clarke, Gedling and Hine 1983, The application of manoeuvring criteria in hull design using linear theory, RINA
125; regressions over ships with length / beam 5 to 8. Shorter vessels are extrapolated, and come out unstable on their course without a
skeg, as barges are.

Resistance of the waves that a hull makes, by the regression of Holtrop and Mennen for displacement hulls.

    R_w = c_1 rho g V exp(m_1 Fn^-0.9 + m_4 cos(lambda Fn^-2)),   Fn = u / sqrt(g L)

with coefficients of the main dimensions. Source: Holtrop and Mennen 1982, An approximate power prediction method, International
Shipbuilding Progress 29, 166; bulb and immersed transom are left out. Range: Fn below 0.4, prismatic coefficient 0.55 to 0.85,
length / beam 3.9 to 9.5, beam / draft 2.1 to 4. Outside it, the values are extrapolated; fuller forms are taken as those of the range's
end. Below Fn = 0.15 it is next to nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from oilsim.core.physical_constants import GRAVITY
from vessels.hull import Hull
from vessels.loads import FORM, FRICTION_SPEED, hull_loads, ittc_friction, wetted_area

# [1] share of the sway added mass that slows a turning hull; paper (Inoue, Hirano and Kijima 1981: 0.5 to 0.75); the lower end
TURNING = 0.5
# [1] lift slope of a skeg of aspect ratio 1, and [L] its place; paper (Fujii: 6.13 / (1 + 2.25)); layout
SKEG_SLOPE, SKEG_PLACE = 6.13 / 3.25, -0.4
# [m/s] slowest speed at which friction is evaluated; numerical; the line has no value at rest
CREEP = 0.05


@dataclass(frozen=True, kw_only=True)
class SteeringDerivatives:
    """Linear derivatives of sway force and yaw moment by drift and turn, made dimensionless with rho / 2, L and u [-]."""

    sway_drift: float
    sway_turn: float
    yaw_drift: float
    yaw_turn: float


def clarke_derivatives(form: HullForm) -> SteeringDerivatives:
    """Return the derivatives of Clarke et al. 1983 for a hull of these dimensions."""
    scale = -math.pi * (form.draft / form.length) ** 2
    beam_draft, beam_length = form.beam / form.draft, form.beam / form.length
    return SteeringDerivatives(
        sway_drift=scale * (1.0 + 0.4 * form.block * beam_draft),
        sway_turn=scale * (-0.5 + 2.2 * beam_length - 0.08 * beam_draft),
        yaw_drift=scale * (0.5 + 2.4 * form.draft / form.length),
        yaw_turn=scale * (0.25 + 0.039 * beam_draft - 0.56 * beam_length),
    )


class HullForces:
    """The forces of one hull under way, and its `loads` in the sea."""

    def __init__(self, hull: Hull, skeg_area: float = 0.0) -> None:
        """Prepare the forces of a hull with a skeg of `skeg_area` [m2]."""
        self._skeg = skeg_area
        form = hull.hydrostatics
        self.form = HullForm(
            length=hull.length,
            beam=hull.beam,
            draft=hull.draft,
            volume=form.displaced_volume,
            waterplane=form.waterplane_area,
        )
        self.density = hull.water_density
        self._steering = clarke_derivatives(self.form)
        self._wetted = wetted_area(hull)
        self.loads = hull_loads(hull)
        carried = np.sum([part.added_mass for part in self.loads.parts], axis=0)
        self._surge, self._sway = float(carried[0]), float(carried[1])

    def resistance(self, speed: float) -> float:
        """Return the resistance [N] of the bare hull ahead at `speed` [m/s], 0 or more: friction with the form factor, and waves."""
        return self._friction(speed, speed) + wave_resistance(self.form, speed, self.density)

    def push(self, ahead: float, to_port: float, turn_rate: float) -> tuple[float, float, float]:
        """Return force ahead and to port [N] and yaw moment [N m] at the speeds [m/s] through the water and the rate of turn [rad/s]."""
        half, length, steering = 0.5 * self.density, self.form.length, self._steering
        fin_place = SKEG_PLACE * length
        fin = -half * self._skeg * SKEG_SLOPE * abs(ahead) * (to_port + fin_place * turn_rate)
        beyond = wave_resistance(self.form, ahead, self.density)
        beyond += self._friction(ahead, ahead) - self._friction(ahead, FRICTION_SPEED)
        drift, turn = steering.sway_drift * abs(ahead) * to_port, steering.sway_turn * length * ahead * turn_rate
        weather, damping = steering.yaw_drift * ahead * to_port, steering.yaw_turn * length * abs(ahead) * turn_rate
        return (
            -math.copysign(1.0, ahead) * beyond + (TURNING * self._sway - self._surge) * to_port * turn_rate,
            half * length**2 * (drift + turn) + self._sway * ahead * turn_rate + fin,
            half * length**3 * (weather + damping) + fin_place * fin,
        )

    def _friction(self, speed: float, evaluated_at: float) -> float:
        """Return friction [N] at `speed` [m/s], with the coefficient of another one."""
        coefficient = (1.0 + FORM) * ittc_friction(max(abs(evaluated_at), CREEP), self.form.length)
        return 0.5 * self.density * coefficient * self._wetted * speed**2


# [1] fullest form that is taken; paper (Holtrop and Mennen 1982, range of the data); prismatic and waterplane coefficient
FULLEST, FULLEST_WATERPLANE = 0.85, 0.92
# [1] Froude number under which waves are left out; numerical; the exponent is under -11 there
SLOWEST = 0.1


@dataclass(frozen=True, kw_only=True)
class HullForm:
    """Main dimensions of a hull afloat.

    length, beam, draft [m] of the waterline; volume [m3] displaced; waterplane [m2]; midship: midship section area / (beam draft) [-].
    """

    length: float
    beam: float
    draft: float
    volume: float
    waterplane: float
    midship: float = 1.0

    @property
    def block(self) -> float:
        """Displaced volume over that of the box around it."""
        return self.volume / (self.length * self.beam * self.draft)

    @property
    def prismatic(self) -> float:
        """Prismatic coefficient, at most that of the regression's range."""
        return min(self.block / self.midship, FULLEST)


def entrance_angle(form: HullForm) -> float:
    """Return half the angle of entrance [degrees] of the waterline, by the regression of Holtrop and Mennen 1982."""
    length_beam, prismatic = form.length / form.beam, form.prismatic
    waterplane = min(form.waterplane / (form.length * form.beam), FULLEST_WATERPLANE)
    run = form.length * (1.0 - prismatic)
    exponent = -(length_beam**0.80856) * (1.0 - waterplane) ** 0.30484 * (1.0 - prismatic) ** 0.6367
    exponent *= (run / form.beam) ** 0.34574 * (100.0 * form.volume / form.length**3) ** 0.16302
    return 1.0 + 89.0 * math.exp(exponent)


def wave_resistance(form: HullForm, speed: float, density: float, entrance: float | None = None) -> float:
    """Return the resistance [N], 0 or more, at `speed` [m/s] in water of `density` [kg/m3].

    entrance [degrees] replaces the half angle of entrance of the regression.
    """
    froude = abs(speed) / math.sqrt(GRAVITY * form.length)
    if froude < SLOWEST:
        return 0.0
    half_angle = entrance_angle(form) if entrance is None else entrance
    slender, length_beam = form.beam / form.length, form.length / form.beam
    c7 = 0.229577 * slender**0.33333 if slender < 0.11 else slender if slender < 0.25 else 0.5 - 0.0625 * length_beam
    c1 = 2223105.0 * c7**3.78613 * (form.draft / form.beam) ** 1.07961 * (90.0 - half_angle) ** -1.37565
    prismatic, cube = form.prismatic, form.volume ** (1.0 / 3.0)
    c16 = (
        8.07981 * prismatic - 13.8673 * prismatic**2 + 6.984388 * prismatic**3
        if prismatic < 0.8
        else 1.73014 - 0.7067 * prismatic
    )
    m1 = 0.0140407 * form.length / form.draft - 1.75254 * cube / form.length - 4.79323 * slender - c16
    fineness = form.length**3 / form.volume
    c15 = -1.69385 if fineness < 512.0 else 0.0 if fineness > 1727.0 else -1.69385 + (form.length / cube - 8.0) / 2.36
    m4 = c15 * 0.4 * math.exp(-0.034 * froude**-3.29)
    wave = 1.446 * prismatic - (0.03 * length_beam if length_beam < 12.0 else 0.36)
    return c1 * form.volume * density * GRAVITY * math.exp(m1 * froude**-0.9 + m4 * math.cos(wave * froude**-2))
