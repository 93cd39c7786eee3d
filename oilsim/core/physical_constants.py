"""Constants of nature and of the Earth that several packages must agree on, and units in those of SI.

The units have the values that `scipy.constants` gives (tested), whose import takes a quarter of a second.
"""

from __future__ import annotations

import math

# [m/s2] acceleration of free fall unless another is given; paper (CGPM 1901); the standard 9.80665, rounded
GRAVITY = 9.81
# [kg/m3] density of air; paper (International Standard Atmosphere, ISO 2533); 15 degrees C, sea level
AIR_DENSITY = 1.225
# [kg/m3] density of sea water; paper (UNESCO equation of state, 1980); 1026.95 for 35 g/kg at 10 degrees C, rounded
SEA_WATER_DENSITY = 1027.0
# [s] an hour; paper (SI, 2019); 60 minutes
HOUR = 3600.0
# [rad] a degree; theory; pi / 180
DEGREE = math.pi / 180.0
# [m] a nautical mile; paper (Hydrographic Conference 1929); by definition
NAUTICAL_MILE = 1852.0
# [m/s] a knot; theory; a nautical mile an hour
KNOT = NAUTICAL_MILE / HOUR
# [m/s2] standard acceleration of free fall; paper (CGPM 1901); defines the kilogram-force
STANDARD_GRAVITY = 9.80665
# [N] a pound-force; theory; 0.45359237 kg (international yard and pound agreement, 1959) times the standard acceleration
POUND_FORCE = 0.45359237 * STANDARD_GRAVITY
