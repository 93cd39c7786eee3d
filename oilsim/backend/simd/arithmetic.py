"""Arithmetic of lanes: + - * / and unary minus among lanes and float32 scalars, and the functions that kernels need beside them.

Every function stands here twice: as Python and numpy run it where the compiler is switched off, and as LLVM does.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import lower_builtin, lower_cast, type_callable

from oilsim.backend.simd.types import LANES, REALS, TRUTHS, call, compiled, constant, every


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
