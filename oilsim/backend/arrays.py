"""Arrays in annotations, by what they hold; docstrings give shapes and units."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Real = NDArray[np.float32]
Flags = NDArray[np.bool_]
Ints = NDArray[np.int64]
Index = NDArray[np.uint32]
