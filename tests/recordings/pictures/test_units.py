"""A picture shows knots, litres, degrees, kilonewtons and cubic metres an hour; its recording has SI units."""

import numpy as np
import pytest

from recordings.pictures.style import shown_in


@pytest.mark.parametrize(
    ("title", "largest", "shown", "value"),
    [
        ("Speed [m/s]", 0.36, "Speed [knots]", 0.6998),
        ("Oil held and lost [m³]", 0.24, "Oil held and lost [litres]", 240.0),
        ("Oil held and lost [m³]", 12.0, "Oil held and lost [m³]", 12.0),
        ("Recovery rate of skimmers [m³/s]", 0.01, "Recovery rate of skimmers [m³/h]", 36.0),
        ("Largest lean of the skirt [rad]", np.pi / 6.0, "Largest lean of the skirt [degrees]", 30.0),
        ("Tow tension [N]", 80.0, "Tow tension [N]", 80.0),
        ("Tow tension [N]", 2500.0, "Tow tension [kN]", 2.5),
        ("Particles asleep", 900.0, "Particles asleep", 900.0),
        ("Gap ratio [-]", 0.3, "Gap ratio [-]", 0.3),
    ],
)
def test_a_diagram_in_the_units_of_a_response_school(title: str, largest: float, shown: str, value: float) -> None:
    found, factor = shown_in(title, largest)
    assert found == shown
    assert factor * largest == pytest.approx(value, rel=1e-3)
