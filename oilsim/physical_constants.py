"""Constants of nature and of the Earth that several packages must agree on. `scipy.constants` converts units."""

from __future__ import annotations

# [m/s2] acceleration of free fall unless another is given; paper (CGPM 1901); the standard 9.80665, rounded
GRAVITY = 9.81
# [kg/m3] density of air; paper (International Standard Atmosphere, ISO 2533); 15 degrees C, sea level
AIR_DENSITY = 1.225
# [kg/m3] density of sea water; paper (UNESCO equation of state, 1980); 1026.95 for 35 g/kg at 10 degrees C, rounded
SEA_WATER_DENSITY = 1027.0
