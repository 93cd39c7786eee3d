"""Constants of nature and of the Earth that several packages must agree on; conversions of units are `scipy.constants`'."""

from __future__ import annotations

GRAVITY = 9.81
"""Acceleration of free fall [m/s2] where nothing else is said: the standard 9.80665 (CGPM 1901), rounded."""
AIR_DENSITY = 1.225
"""Density of air at 15 degrees C and sea level [kg/m3] (International Standard Atmosphere, ISO 2533)."""
SEA_WATER_DENSITY = 1027.0
"""Density of sea water of 35 g/kg at 10 degrees C [kg/m3] (UNESCO equation of state, 1980: 1026.95)."""
