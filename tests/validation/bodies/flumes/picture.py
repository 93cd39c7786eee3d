"""A picture of a flume: its oil, and how fast the water runs around it."""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from oilsim import Fluid
from tests.validation.bodies.flumes.flume import Flume

BELOW, ABOVE = 1.8, 0.4  # d: what is shown below and above the level
WIDTH = 72.0 * 9.5  # points: of the flume in the picture


def picture_file(text: str) -> Path:
    """Return the path of a picture; argparse.ArgumentTypeError for an ending that no picture has, before hours of computing."""
    path, allowed = Path(text), plt.figure().canvas.get_supported_filetypes()
    plt.close()
    if path.suffix.lstrip(".") not in allowed:
        raise argparse.ArgumentTypeError(f"{text!r} ends in {path.suffix!r}, allowed: .{', .'.join(sorted(allowed))}")
    return path


def draw(path: Path, fluid: Fluid, shape: Flume, speed: float, title: str) -> None:
    """Draw oil, skirt, and the water by its speed along the flume over `speed` [m/s] of the current, into a picture at `path`."""
    water, oil = fluid.phase_positions("water"), fluid.phase_positions("oil")
    share = fluid.phase_velocities("water")[:, 0] / speed
    figure, axes = plt.subplots(figsize=(11.0, 4.2), layout="constrained")
    size = (
        WIDTH * fluid.config.particle_spacing / (shape.length * shape.draft)
    ) ** 2  # points2, as areas of dots are given
    dots = axes.scatter(water[:, 0], water[:, 2], c=share, s=size, cmap="coolwarm", vmin=-1.0, vmax=2.0, linewidths=0)
    axes.scatter(oil[:, 0], oil[:, 2], c="black", s=size, linewidths=0)
    foot, top = np.array([-1.0, shape.freeboard]) * shape.draft + shape.level
    axes.plot([shape.skirt_place] * 2, [foot, top], color="tab:green", linewidth=3.0)
    figure.colorbar(dots, label="speed along the flume / current", shrink=0.7)
    axes.set(
        title=title, xlabel="x [m]", ylabel="z [m]", aspect="equal", xlim=(0.0, shape.length * shape.draft),
        ylim=(shape.level - BELOW * shape.draft, shape.level + ABOVE * shape.draft),
    )  # fmt: skip
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=100)
    plt.close(figure)
