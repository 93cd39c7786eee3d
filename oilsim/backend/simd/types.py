"""Vectors of several numbers as numba's types, and the LLVM operations from which all others are made.

Everything in this room generates LLVM's portable vector operations, with one set of helpers. The number of lanes belongs to a vector's
type: kernels calculate with LANES, the search packs with as many as the processor packs in one instruction (see `compaction`).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typeconv import Conversion
from numba.extending import lower_builtin, models, register_model, type_callable

# [numbers] of a vector in kernels; measured; 16 are no faster, since the last round of a list is emptier
LANES = 8

INT, LONG = ir.IntType(32), ir.IntType(64)


class Vector(types.Type):
    """Numba's type of some lanes: numbers, truth values, or indices, which stay in memory since lanes are fetched one by one.

    element: its name; llvm: the element's LLVM type; mark: how LLVM's operations call it; lanes: how many.
    """

    def __init__(self, element: str, llvm: Any, mark: str, lanes: int = LANES) -> None:
        self.llvm, self.suffix, self.lanes = ir.VectorType(llvm, lanes), f"v{lanes}{mark}", lanes
        super().__init__(name=f"{element} x {lanes}")

    def can_convert_from(self, typingctx: Any, other: types.Type) -> Conversion | None:
        """Let a float32 stand for lanes that all hold it."""
        return Conversion.safe if self == REALS and other == types.float32 else None


def reals(lanes: int) -> Vector:
    """Return the type of so many float32."""
    return Vector("float32", ir.FloatType(), "f32", lanes)


def indices(lanes: int) -> Vector:
    """Return the type of so many uint32."""
    return Vector("uint32", INT, "i32", lanes)


REALS, INDICES = reals(LANES), indices(LANES)
TRUTHS = Vector("bool", ir.IntType(1), "i1")


@register_model(Vector)
class VectorModel(models.PrimitiveModel):
    """A vector is one value to LLVM."""

    def __init__(self, manager: Any, vector: Vector) -> None:
        super().__init__(manager, vector, vector.llvm.as_pointer() if vector == INDICES else vector.llvm)


def compiled(function: Callable[..., Any], typing: Callable[..., Any]) -> Callable[..., Any]:
    """Register the decorated function as generator of LLVM code; `typing` returns a numba signature for argument types, or None."""
    type_callable(function)(lambda context: typing)
    return lower_builtin(function, types.VarArg(types.Any))


def constant(vector: Vector, value: float) -> Any:
    """Return the same number in every lane."""
    return ir.Constant(vector.llvm, [value] * vector.lanes)


def numbered(vector: Vector) -> Any:
    """Return 0, 1, 2, ... by lane."""
    return ir.Constant(vector.llvm, list(range(vector.lanes)))


def call(builder: Any, name: str, result: Any, *arguments: Any, fast: bool = False) -> Any:
    """Call an operation of LLVM by its name; a `fast` one may round, and order sums, as is quickest."""
    function = cgutils.get_or_insert_function(
        builder.module, ir.FunctionType(result, [argument.type for argument in arguments]), f"llvm.{name}"
    )
    return builder.call(function, arguments, fastmath=("fast",) if fast else ())


def every(builder: Any, value: Any, vector: Vector = REALS) -> Any:
    """Return a scalar in every lane."""
    nothing = ir.Constant(vector.llvm, ir.Undefined)
    first = ir.Constant(ir.VectorType(INT, vector.lanes), [0] * vector.lanes)
    return builder.shuffle_vector(builder.insert_element(nothing, value, INT(0)), nothing, first)
