"""A net in the place of a skirt: a screen that lets the water through, with its drag and the speed of the water behind it (*modelled*).

Of the area of a net, the share S (solidity) is twine. In water that meets it square (Loeland 1991, Current forces on and flow through
fish farms, NTH Trondheim; plane screens of S from 0.13 to 0.32),

    C_d = S - 1.24 S^2 + 13.7 S^3,    u / U = 1 - 0.46 C_d.

Meshes are square: with an opening w between twines at a pitch p, (w / p)^2 = 1 - S.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from oilsim.core.quantity import quantity, require

# [-] loss of speed behind a net over its drag coefficient; measured (Loeland 1991)
WAKE = 0.46


@dataclass(frozen=True, kw_only=True)
class Net:
    """A net of square meshes: solidity [-], the share of its area that is twine, and mesh_opening [m] between two twines.

    Raises ValueError for a net outside the range of the formulas.
    """

    solidity: float = quantity("", at_least=0.13, at_most=0.32)
    mesh_opening: float = quantity("m", above=0.0, at_most=0.2)

    def __post_init__(self) -> None:
        require("net", Net, vars(self))

    @property
    def drag_coefficient(self) -> float:
        """Drag C_d [-] of the net's whole area in water that meets it square."""
        return self.solidity - 1.24 * self.solidity**2 + 13.7 * self.solidity**3

    @property
    def through_share(self) -> float:
        """Speed of the water that passes the net, over that of the undisturbed water [-]; the rest of the water goes round."""
        return 1.0 - WAKE * self.drag_coefficient

    @property
    def mesh_pitch(self) -> float:
        """Distance [m] from twine to twine, p = w / sqrt(1 - S)."""
        return self.mesh_opening / math.sqrt(1.0 - self.solidity)
