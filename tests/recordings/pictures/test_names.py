"""Names of vessels in plans do not lie on each other."""

import itertools

import numpy as np
from matplotlib.figure import Figure
from scipy.spatial import ConvexHull

from recordings.model.frame import BodyFrame, MeshDescription
from recordings.pictures.chart import draw_body, spread_names

CORNERS = np.array(list(itertools.product((-7.5, 7.5), (-2.5, 2.5), (0.0, 1.0))), dtype=np.float32)
HULL = MeshDescription(vertices=CORNERS, faces=ConvexHull(CORNERS).simplices.astype(np.uint32))


def test_names_of_vessels_side_by_side_are_pushed_apart():
    """Two vessels 25 m apart in a plan of a kilometre; a third one far away keeps its name where it is."""
    axes = Figure(figsize=(6.0, 6.0)).subplots()
    axes.set(xlim=(-500.0, 500.0), ylim=(-500.0, 500.0))
    for name, y in (("one", 150.0), ("two", 125.0), ("three", -300.0)):
        body = BodyFrame(position=np.array((0.0, y, 0.0)), orientation=np.array((0.0, 0.0, 0.0, 1.0)))
        draw_body(axes, f"vessels/{name}", HULL, body, (0, 1), 1.0)
    one, two, three = axes.texts
    assert one.get_window_extent().overlaps(two.get_window_extent())
    spread_names(axes)
    assert not one.get_window_extent().overlaps(two.get_window_extent())
    assert one.xyann[1] > 0.0 > two.xyann[1]
    assert three.xyann == (0.0, 0.0)
