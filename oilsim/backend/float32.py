"""Small numbers in single precision, for kernels: a plain 1.0 would turn products with it into double precision."""

from __future__ import annotations

import numpy as np

ZERO, HALF, ONE = np.float32(0.0), np.float32(0.5), np.float32(1.0)
TWO, THREE = np.float32(2.0), np.float32(3.0)
