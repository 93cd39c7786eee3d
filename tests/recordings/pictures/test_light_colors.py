"""Oil that splashed over is white in the viewer; on the white ground of a picture its line has an edge."""

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from recordings.model import palette
from recordings.pictures.style import edge_of_light, is_light


@pytest.mark.parametrize("cause", palette.CAUSES)
def test_the_line_of_each_cause_is_seen_on_white(cause: str) -> None:
    figure = Figure(figsize=(2.0, 1.0), dpi=100, facecolor="white")
    canvas = FigureCanvasAgg(figure)
    color = palette.css(palette.cause_color(cause))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    axes.plot([0.0, 1.0], [0.0, 0.0], color=color, linewidth=1.6, path_effects=edge_of_light(color, 1.6))
    canvas.draw()
    darkest = np.asarray(canvas.buffer_rgba())[..., :3].min(axis=(0, 1))
    assert darkest.min() < 190  # without an edge, white is 255


def test_only_what_is_nearly_white_has_an_edge() -> None:
    light = {cause for cause in palette.CAUSES if is_light(palette.css(palette.cause_color(cause)))}
    assert light == {"splash_over"}
