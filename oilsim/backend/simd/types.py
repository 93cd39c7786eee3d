"""Vectors of several numbers as numba's types, and the LLVM operations from which all others are made.

Everything in this room generates LLVM's portable vector operations, with one set of helpers. The number of lanes belongs to a vector's
type: kernels calculate with LANES, the search packs with as many as the processor packs in one instruction (see `compaction`).

Arithmetic of lanes: + - * / and unary minus among lanes and float32 scalars, and the functions that kernels need beside them.

Every function stands here twice: as Python and numpy run it where the compiler is switched off, and as LLVM does.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typeconv import Conversion
from numba.extending import lower_builtin, lower_cast, models, register_model, type_callable

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


def above_zero(lanes):
    """Return which lanes are above 0."""
    return lanes > 0.0


@compiled(above_zero, lambda lanes: TRUTHS(REALS))
def _above_zero(context, builder, signature, arguments):
    return builder.fcmp_ordered(">", arguments[0], ir.Constant(REALS.llvm, None))


def only(present, lanes, otherwise):
    """Return `lanes` where `present`, the scalar or lanes `otherwise` elsewhere."""
    return np.where(present, lanes, otherwise)


@compiled(only, lambda present, lanes, otherwise: REALS(TRUTHS, REALS, REALS))
def _only(context, builder, signature, arguments):
    return builder.select(*arguments)


def spread(value):
    """Return lanes that all hold one float32; numpy gets a scalar, so that two names for one result stay two numbers under +=."""
    return np.float32(value)


@compiled(spread, lambda value: REALS(REALS))
def _spread(context, builder, signature, arguments):
    return arguments[0]


@lower_cast(types.float32, REALS)
def _cast(context, builder, source, target, value):
    return every(builder, value)


def summed(lanes):
    """Return the sum of the lanes, always in the same order."""
    return np.broadcast_to(lanes, LANES).sum(dtype=np.float32)


@compiled(summed, lambda lanes: types.float32(REALS))
def _summed(context, builder, signature, arguments):
    nothing = REALS.llvm.element(-0.0)
    return call(builder, f"vector.reduce.fadd.{REALS.suffix}", REALS.llvm.element, nothing, *arguments, fast=True)


def root(x):
    """Return the square root of a scalar or of lanes."""
    return np.sqrt(x)


def floor(x):
    """Return the next whole number below a scalar or lanes; unlike math.floor it stays a float."""
    return np.floor(x)


def rounded(x):
    """Return the whole number nearest to a scalar or to lanes; it stays a float."""
    return np.rint(x)


def positive(x):
    """Return max(x, 0) of a scalar or of lanes."""
    return np.maximum(x, x - x)


def _same(x):
    return x(x) if x == REALS or isinstance(x, types.Float) else None


def _elementwise(function: Callable[..., Any], name: str) -> None:
    @compiled(function, _same)
    def generate(context, builder, signature, arguments):
        suffix = {types.float32: "f32", types.float64: "f64"}.get(signature.return_type, REALS.suffix)
        return call(builder, f"{name}.{suffix}", arguments[0].type, *arguments, fast=True)


_elementwise(root, "sqrt")
_elementwise(floor, "floor")
_elementwise(rounded, "rint")


@compiled(positive, _same)
def _positive(context, builder, signature, arguments):
    (x,) = arguments
    nothing = ir.Constant(x.type, None)
    return builder.select(builder.fcmp_ordered(">", x, nothing), x, nothing)


def _arithmetic(left, right):
    """Return the signature of lanes with lanes or float32 scalars; None for anything else, doubles included."""
    return REALS(REALS, REALS) if REALS in (left, right) and {left, right} <= {REALS, types.float32} else None


def _operator(function: Callable[..., Any], name: str) -> None:
    type_callable(function)(lambda context: _arithmetic)

    @lower_builtin(function, REALS, REALS)
    def generate(context, builder, signature, arguments):
        return getattr(builder, name)(*arguments)


for _symbol in ("add", "sub", "mul", "truediv"):
    for _form in (_symbol, f"i{_symbol}"):
        _operator(getattr(operator, _form), f"f{_symbol.removeprefix('true')}")


@lower_builtin(operator.neg, REALS)
def _negative(context, builder, signature, arguments):
    return builder.fsub(constant(REALS, -0.0), arguments[0])


type_callable(operator.neg)(lambda context: lambda x: REALS(REALS) if x == REALS else None)
