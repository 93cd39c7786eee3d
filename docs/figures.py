"""Draws the figures of the pages on the method from closed forms: ``python docs/figures.py`` writes docs/pictures/figure-*.svg."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, FancyArrowPatch, Rectangle

FOLDER = Path(__file__).with_name("pictures")
WATER, OIL, WALL, INK, RED = "#3b7ea1", "#6b4a2b", "#9aa0a6", "#222222", "#b3392f"
SUPPORT = 2.75  # [d]
GRAVITY = 9.81  # [m/s2]


def arrow(
    axes: Axes, start: tuple[float, float], end: tuple[float, float], color: str = INK, width: float = 1.2
) -> None:
    """Draw an arrow from start to end."""
    axes.add_patch(
        FancyArrowPatch(start, end, arrowstyle="-|>", mutation_scale=11, color=color, lw=width, shrinkA=0, shrinkB=0)
    )


def kernel_and_walls() -> None:
    """Particles, their support and the layers of a wall; the kernel and its slope."""
    figure, (scene, graph) = plt.subplots(1, 2, figsize=(9.0, 3.4), width_ratios=(1.15, 1.0))
    places = np.stack(np.meshgrid(np.arange(9), np.arange(5)), axis=-1).reshape(-1, 2) + 0.5
    jitter = np.random.default_rng(4).normal(0.0, 0.07, places.shape)
    middle = np.array([4.5, 1.5])
    for place, off in zip(places, jitter, strict=True):
        near = np.hypot(*(place - middle)) < SUPPORT
        scene.add_patch(
            Circle(
                tuple(place + (off if tuple(place) != tuple(middle) else 0.0)),
                0.3,
                color=WATER,
                alpha=0.9 if near else 0.35,
                lw=0,
            )
        )
    for x in np.arange(-1, 10) + 0.5:
        for z in (-0.5, -1.5):
            scene.add_patch(
                Rectangle(
                    (x - 0.3, z - 0.3),
                    0.6,
                    0.6,
                    color=WALL,
                    lw=0,
                    alpha=0.9 if np.hypot(x - 4.5, z - 1.5) < SUPPORT else 0.5,
                )
            )
    scene.add_patch(Circle(tuple(middle), SUPPORT, fill=False, color=RED, lw=1.5))
    scene.plot(*middle, "o", color=RED, ms=5)
    arrow(scene, (4.5, 1.5), (4.5 + SUPPORT * 0.8, 1.5 + SUPPORT * 0.6), RED)
    scene.text(
        7.35,
        2.9,
        "support\nH = 2.75 d",
        color=RED,
        fontsize=8,
        ha="left",
        va="center",
        bbox={"fc": "white", "ec": "none", "pad": 1},
    )
    scene.text(4.2, 1.15, "i", color=RED, fontsize=11, ha="right")
    scene.axhline(0.0, color=INK, lw=1.0)
    scene.text(-0.9, 0.1, "wall's surface", fontsize=8, va="bottom")
    scene.text(9.0, 5.15, "free surface", fontsize=8, ha="right")
    scene.text(-0.9, -2.45, "two layers of wall continue the lattice", fontsize=8)
    scene.set(xlim=(-1.1, 10.1), ylim=(-2.6, 5.7), aspect="equal")
    scene.axis("off")
    q = np.linspace(0.0, 1.0, 200)
    graph.plot(q * SUPPORT, (1 - q) ** 4 * (1 + 4 * q), color=WATER, label="W / W(0)")
    slope = 20 * q * (1 - q) ** 3
    graph.plot(q * SUPPORT, slope / slope.max(), color=RED, label="-W' / its largest")
    graph.set(xlabel="distance r / d", xlim=(0, 3), ylim=(0, 1.05), title="Wendland's C2 kernel")
    for r in (1.0, np.sqrt(2.0), 2.0, np.sqrt(5.0)):
        graph.axvline(r, color=WALL, lw=0.7, ls=":")
    graph.text(1.02, 0.03, "neighbours of a lattice", fontsize=7, color=WALL)
    graph.legend(frameon=False, fontsize=8)
    save(figure, "kernel")


STAGES = (
    ("advect", "x += Δt v", 0),
    ("sum", "density,\nmoments, ∇v", 2),
    ("relax", "move x,\nsmooth v", 2),
    ("force", "gravity, sea,\ntension", 1),
    ("press", "pressure of\nthe last step", 1),
    ("viscosity", "implicit,\nwith bodies", 1),
    ("pressure", "bounded,\nwith bodies", 1),
    ("contact", "drops,\nthin plates", 1),
)


def order_of_a_step() -> None:
    """The stages of a step, and which of them change positions and which velocities."""
    figure, axes = plt.subplots(figsize=(9.0, 2.3))
    for n, (name, does, lane) in enumerate(STAGES):
        height, low = (1.0, 1.0 - lane) if lane < 2 else (2.0, 0.0)
        color = (WATER, RED, "#6d5a8c")[lane]
        axes.add_patch(Rectangle((n + 0.07, low + 0.05), 0.86, height - 0.1, fc=color, ec=color, alpha=0.18, lw=0))
        axes.add_patch(Rectangle((n + 0.07, low + 0.05), 0.86, height - 0.1, fill=False, ec=color, lw=1.2))
        axes.text(n + 0.5, low + height / 2 + 0.24, name, ha="center", va="center", fontsize=9.5, fontweight="bold")
        axes.text(n + 0.5, low + height / 2 - 0.14, does, ha="center", va="center", fontsize=7.5)
        axes.text(n + 0.5, 2.06, str(n + 1), ha="center", va="bottom", fontsize=9)
    arrow(axes, (0.6, 2.42), (7.9, 2.42))
    axes.text(0.5, 2.42, "a step", ha="right", va="center")
    axes.text(-0.05, 1.5, "positions", ha="right", va="center", color=WATER)
    axes.text(-0.05, 0.5, "velocities", ha="right", va="center", color=RED)
    axes.set(xlim=(-0.85, 8.02), ylim=(-0.02, 2.6))
    axes.axis("off")
    save(figure, "step")


def share_of_implicit_viscosity() -> None:
    """The share that a step leaves of the finest shear wave, by the share theta of implicit viscosity."""
    figure, axes = plt.subplots(figsize=(5.6, 3.0))
    z = np.geomspace(0.05, 300.0, 300)
    ours = np.maximum(0.5, 1.0 - 2.0 / z)
    for theta, color, label, style in (
        (np.ones_like(z), WALL, "backward Euler, θ = 1", "-"),
        (np.full_like(z, 0.5), WATER, "trapezoidal rule, θ = 1/2", "-"),
        (ours, RED, "θ = max(1/2, 1 - 2/z)", "--"),
    ):
        axes.plot(z, (1 - (1 - theta) * z) / (1 + theta * z), color=color, label=label, ls=style, lw=1.8)
    axes.plot(z, np.exp(-z), color=INK, lw=1.0, ls=":", label="exact, exp(-z)")
    axes.axhline(0.0, color=INK, lw=0.5)
    axes.set(xscale="log", xlabel="z = 10 ν Δt / d²", ylabel="left after a step", ylim=(-1.05, 1.05))
    axes.legend(frameon=False, fontsize=8, loc="lower left")
    save(figure, "viscosity")


def slick_profile(
    speed: float, front: float, oil: float = 900.0, water: float = 1027.0, friction: float = 0.005
) -> tuple[float, float, float, float]:
    """Return h_f, h_b, K [m] and L [m] of the slick of `front` [m2] before a boom in water of `speed` [m/s]."""
    reduced = GRAVITY * (1 - oil / water)
    head, growth = speed**2 / (2 * reduced), friction * water / oil * speed**2 / reduced
    deep = (head**3 + 1.5 * growth * front) ** (1 / 3)
    return head, deep, growth, (deep**2 - head**2) / growth


def ways_out_of_a_boom() -> None:
    """The profile of a slick before a skirt, to scale, and the ways by which oil leaves."""
    figure, axes = plt.subplots(figsize=(9.0, 3.7))
    head, deep, growth, length = slick_profile(0.36, 0.2)
    draft, freeboard = 0.4, 0.2
    x = np.linspace(0.0, length, 200)
    left = np.linspace(0.0, 0.06, 40)
    under = np.concatenate((head * np.sqrt(1 - (1 - left / 0.06) ** 2), np.sqrt(head**2 + growth * x)))
    along = np.concatenate((left - length - 0.06, x - length))
    axes.fill_between([-4.4, 1.6], -0.75, 0.0, color=WATER, alpha=0.18, lw=0)
    axes.fill_between(along, -under, 0.0, color=OIL, alpha=0.85, lw=0)
    axes.plot([0.0, 0.0], [-draft, 0.0], color=INK, lw=4)
    axes.add_patch(Rectangle((-0.05, 0.0), 0.1, freeboard, color="#d9822b"))
    for z in (-0.18, -0.34, -0.5, -0.66):
        arrow(axes, (-4.3, z), (-3.9, z), WATER)
    axes.text(-4.3, -0.13, "U", color=WATER, fontsize=12, va="bottom")
    axes.annotate(
        "front, $h_f = U^2/2g'$",
        (-length + 0.05, -head),
        (-3.55, -0.34),
        fontsize=8,
        arrowprops={"arrowstyle": "-", "lw": 0.7},
    )
    axes.annotate(
        "at the boom, $h_b$", (-0.08, -deep), (-1.05, -0.3), fontsize=8, arrowprops={"arrowstyle": "-", "lw": 0.7}
    )
    axes.annotate("", (-length, 0.06), (-0.06, 0.06), arrowprops={"arrowstyle": "<->", "lw": 0.8})
    axes.text(-length / 2, 0.075, "length $L$", ha="center", fontsize=8)
    ways = (
        ("entrainment: droplets torn off the front", (-length, -head - 0.03), (-2.2, -0.28), (0.35, -0.58)),
        ("drainage: sucked round the foot", (-0.25, -deep - 0.02), (-0.02, -draft - 0.08), (0.35, -0.27)),
        ("splash-over, submergence: over the top", (-0.12, freeboard + 0.02), (0.0, freeboard + 0.12), (0.35, 0.12)),
    )
    for label, start, bend, end in ways:
        curve = np.linspace(0.0, 1.0, 60)[:, None]
        a, b, c = (np.array(point) for point in (start, bend, end))
        path = (1 - curve) ** 2 * a + 2 * curve * (1 - curve) * (2 * b - (a + c) / 2) + curve**2 * c
        axes.plot(*path[:-2].T, color=RED, lw=1.1, ls="--")
        arrow(axes, tuple(path[-4]), tuple(path[-1]), RED, 1.1)
        axes.text(
            end[0] + 0.04,
            end[1],
            label.split(":")[0] + ":\n" + label.split(": ")[1],
            color=RED,
            fontsize=7.5,
            va="center",
        )
    axes.set_title(
        "oil of 900 kg/m³ at 0.36 m/s (0.7 kn), 0.2 m³ before each metre of a skirt of 0.4 m; heights stretched",
        fontsize=8.5,
    )
    axes.set(
        xlim=(-4.4, 1.6),
        ylim=(-0.75, 0.36),
        yticks=(-0.6, -0.4, -0.2, 0.0),
        xlabel="distance from the boom [m]",
        ylabel="height [m]",
    )
    axes.spines[["top", "right"]].set_visible(False)
    save(figure, "ways-out")


def window_and_rim() -> None:
    """Plan of a window on a boom's apex; the rim's rate and a body's share along a line through the middle."""
    figure, (plan, graph) = plt.subplots(1, 2, figsize=(9.0, 3.6), width_ratios=(1.0, 1.25))
    half, rim, fade = 8.0, 4.0, 2.75 * 0.25
    plan.add_patch(Rectangle((-half, -half), 2 * half, 2 * half, color=WATER, alpha=0.18, lw=0))
    plan.add_patch(
        Rectangle((rim - half, rim - half), 2 * (half - rim), 2 * (half - rim), color=WATER, alpha=0.35, lw=0)
    )
    t = np.linspace(-1.0, 1.0, 200)
    boom = np.stack((2.0 - 18.0 * t**2, 12.0 * t), axis=-1)
    inside = np.abs(boom).max(axis=1) < half - rim
    plan.plot(*boom.T, color=WALL, lw=2.5)
    plan.plot(*boom[inside].T, color="#d9822b", lw=3.0)
    plan.text(0.0, -half + 0.3, "rim", ha="center", fontsize=9)
    plan.text(-half + rim + 0.3, half - rim - 1.1, "particles", fontsize=9)
    plan.text(-half - 7.6, 0.0, "sea by\nformulas", fontsize=9)
    plan.text(-10.0, 9.9, "boom", fontsize=9)
    arrow(plan, (-15.5, -6.0), (-12.0, -6.0), WATER)
    plan.text(-15.5, -7.6, "current, waves", fontsize=8, color=WATER)
    plan.set(xlim=(-16.5, 10.5), ylim=(-12.5, 12.5), aspect="equal")
    plan.axis("off")
    x = np.linspace(-11.0, 11.0, 600)
    depth_in_rim = np.clip((np.abs(x) - (half - rim)) / rim, 0.0, 1.0)
    rate = np.where(np.abs(x) <= half, np.sin(np.pi * depth_in_rim / 2) ** 2, np.nan)
    share = np.clip((half - rim - np.abs(x)) / fade + 0.0, 0.0, 1.0)
    graph.plot(x, share, color="#d9822b", lw=2, label="share of particles in a body's load")
    graph.plot(x, 1 - share, color=WALL, lw=2, label="share of formulas")
    graph.plot(x, rate, color=WATER, lw=1.8, ls="--", label="rate of the rim over r")
    for edge in (-half, half):
        graph.axvline(edge, color=INK, lw=0.8, ls=":")
    graph.text(half + 0.1, 0.5, "side", fontsize=8, rotation=90, va="center")
    graph.set(xlabel="distance from the middle [m]", ylim=(-0.03, 1.32), yticks=(0, 0.5, 1))
    graph.legend(frameon=False, fontsize=8, ncol=2, loc="upper center")
    graph.spines[["top", "right"]].set_visible(False)
    save(figure, "window")


def save(figure: plt.Figure, name: str) -> None:
    """Write a figure as docs/pictures/figure-NAME.svg, the same bytes each time."""
    figure.tight_layout()
    figure.savefig(FOLDER / f"figure-{name}.svg", metadata={"Date": None})
    plt.close(figure)


if __name__ == "__main__":
    mpl.use("Agg")
    mpl.rcParams.update({"svg.hashsalt": "oilsim", "font.size": 9, "savefig.facecolor": "white"})
    for draw in (kernel_and_walls, order_of_a_step, share_of_implicit_viscosity, ways_out_of_a_boom, window_and_rim):
        draw()
