"""The longest stable step of a line that a winch changes is that of the shorter of its two lengths."""

from __future__ import annotations

import numpy as np
import pytest

from coupling.multibody.lines import ElasticLine, Lines


def longest_step(length: float, ordered: float) -> float:
    lines = Lines()
    points = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 3.0]])
    lines.add("line", ElasticLine((0, -1), points, stiffness=100.0, relaxation_time=0.0, length=length))
    lines.order_length("line", ordered)
    pose = np.array([[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]])
    return lines.longest_step(pose, np.eye(6)[None])


@pytest.mark.parametrize(("length", "ordered"), [(2.0, 0.5), (0.5, 2.0)])
def test_a_line_steps_as_its_shorter_length_asks(length: float, ordered: float) -> None:
    assert longest_step(length, ordered) == pytest.approx(longest_step(0.5, 0.5))
    assert longest_step(2.0, 2.0) == pytest.approx(2.0 * longest_step(0.5, 0.5))  # as the root of the length
