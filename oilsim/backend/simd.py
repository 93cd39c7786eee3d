"""LANES numbers at a time: loops over the neighbours of a particle, written for vector registers.

A particle has some 70 neighbours. Compilers make rounds of 64 of such a loop and leave the rest to scalar code, and they give up
on loops that store. So kernels say themselves that they take LANES neighbours a round, of which the last may be absent:

    for k in range(first, last, LANES):
        present = below(last, k)
        j = load(neighbor, k, present)
        sum += load(gradient, k, present) * gather(kappa, j)
    result = summed(sum)

Lanes and float32 scalars mix under + - * / and unary minus; a double is refused, so none can slip in. The functions below are also
what runs where the compiler is switched off, on numpy arrays; compiled they become LLVM's portable vector operations. A thread
of a GPU, which has one lane, would run the same kernels with LANES = 1.
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

AHEAD = 2048  # bytes: lists are read in turn, but processors that also gather were measured to wait for half of a pass's time
LANES = 8  # 16, where registers have them, was measured no faster: the last round is emptier


class Vector(types.Type):
    """Numba's type of LANES elements: numbers, truth values, or indices, which stay in memory: lanes are fetched one by one."""

    def __init__(self, element: str, llvm: Any, mark: str) -> None:
        self.llvm, self.suffix = ir.VectorType(llvm, LANES), f"v{LANES}{mark}"
        super().__init__(name=f"{element} x {LANES}")

    def can_convert_from(self, typingctx: Any, other: types.Type) -> Conversion | None:
        """A float32 may stand for lanes that all hold it."""
        return Conversion.safe if self == REALS and other == types.float32 else None


REALS = Vector("float32", ir.FloatType(), "f32")
INDICES = Vector("uint32", ir.IntType(32), "i32")
TRUTHS = Vector("bool", ir.IntType(1), "i1")
ELEMENTS = {types.float32: REALS, types.uint32: INDICES, types.int16: REALS}
SHORTS = ir.VectorType(ir.IntType(16), LANES)


@register_model(Vector)
class VectorModel(models.PrimitiveModel):
    """A vector is one value to LLVM."""

    def __init__(self, manager: Any, vector: Vector) -> None:
        super().__init__(manager, vector, vector.llvm.as_pointer() if vector == INDICES else vector.llvm)


def constant(vector: Vector, value: float) -> Any:
    """The same number in every lane."""
    return ir.Constant(vector.llvm, [value] * LANES)


def call(builder: Any, name: str, result: Any, *arguments: Any, fast: bool = False) -> Any:
    """Call an operation of LLVM by its name; if `fast` it may round, and order sums, as is quickest."""
    function = cgutils.get_or_insert_function(
        builder.module, ir.FunctionType(result, [argument.type for argument in arguments]), f"llvm.{name}"
    )
    return builder.call(function, arguments, fastmath=("fast",) if fast else ())


def every(builder: Any, value: Any, vector: Vector = REALS) -> Any:
    """A scalar in every lane."""
    nothing = ir.Constant(vector.llvm, ir.Undefined)
    return builder.shuffle_vector(
        builder.insert_element(nothing, value, ir.IntType(32)(0)), nothing, constant(INDICES, 0)
    )


def masked_load(builder: Any, base: Any, first: Any, vector: Vector, present: Any) -> Any:
    """The elements base[first + lane] where `present`, 0 elsewhere."""
    place = builder.bitcast(builder.gep(base, [first]), vector.llvm.as_pointer())
    name = f"masked.load.{vector.suffix}.p0"
    return call(builder, name, vector.llvm, place, ir.IntType(32)(4), present, constant(vector, 0))


def fetch_ahead(builder: Any, base: Any, first: Any) -> None:
    """Ask the memory for what comes AHEAD bytes behind base[first], which is harmless beyond an array's end."""
    byte = ir.IntType(8).as_pointer()
    place = builder.gep(builder.bitcast(builder.gep(base, [first]), byte), [ir.IntType(64)(AHEAD)])
    keep, read, data = ir.IntType(32)(3), ir.IntType(32)(0), ir.IntType(32)(1)
    call(builder, "prefetch.p0", ir.VoidType(), place, read, keep, data)


# What kernels call. Every function stands here twice: as Python and numpy run it, and as LLVM does.


def compiled(function: Callable[..., Any], typing: Callable[..., Any]) -> Callable[..., Any]:
    """Decorate what generates a function's LLVM code; `typing` tells its numba signature from argument types, or None."""
    type_callable(function)(lambda context: typing)
    return lower_builtin(function, types.VarArg(types.Any))


def below(last, k):
    """Which of the places k to k + LANES lie below `last`."""
    return k + np.arange(LANES) < last


@compiled(below, lambda last, k: TRUTHS(types.int64, types.int64))
def _below(context, builder, signature, arguments):
    left = builder.trunc(builder.sub(*arguments), INDICES.llvm.element)
    return builder.icmp_signed(">", every(builder, left, INDICES), ir.Constant(INDICES.llvm, list(range(LANES))))


def load(values, k, present):
    """values[k + lane] where `present`, 0 elsewhere; values are float32, uint32 or int16 and lie side by side.

    Whole numbers of 16 bits become float32. They, and indices (uint32), are read LANES at a time: so many must lie in the array from k on,
    and absent indices, which may be fetched too, must be some place's (see `neighbors.end_list`).
    """
    result = np.zeros(LANES, np.float32 if values.dtype == np.int16 else values.dtype)
    result[present] = values[k : k + np.count_nonzero(present)]
    return result


@compiled(load, lambda values, k, present: ELEMENTS[values.dtype](values, types.int64, TRUTHS))
def _load(context, builder, signature, arguments):
    values = context.make_array(signature.args[0])(context, builder, arguments[0])
    fetch_ahead(builder, values.data, arguments[1])
    if signature.return_type == INDICES:
        return builder.bitcast(builder.gep(values.data, [arguments[1]]), INDICES.llvm.as_pointer())
    if signature.args[0].dtype != types.int16:
        return masked_load(builder, values.data, arguments[1], signature.return_type, arguments[2])
    shorts = builder.load(builder.bitcast(builder.gep(values.data, [arguments[1]]), SHORTS.as_pointer()), align=2)
    return builder.select(arguments[2], builder.sitofp(shorts, REALS.llvm), constant(REALS, 0))


def store(values, k, present, lanes):
    """values[k + lane] = lanes where `present`; an array of int16, which takes whole numbers, gets something in absent lanes too."""
    count = LANES if values.dtype == np.int16 else np.count_nonzero(present)
    values[k : k + count] = np.broadcast_to(lanes, LANES)[:count]


@compiled(store, lambda values, k, present, lanes: types.void(values, types.int64, TRUTHS, ELEMENTS[values.dtype]))
def _store(context, builder, signature, arguments):
    values, k, present, lanes = arguments
    base, vector = context.make_array(signature.args[0])(context, builder, values).data, signature.args[3]
    if signature.args[0].dtype == types.int16:
        place = builder.bitcast(builder.gep(base, [k]), SHORTS.as_pointer())
        builder.store(builder.fptosi(lanes, SHORTS), place, align=2)
        return context.get_dummy_value()
    place = builder.bitcast(builder.gep(base, [k]), vector.llvm.as_pointer())
    call(builder, f"masked.store.{vector.suffix}.p0", ir.VoidType(), lanes, place, ir.IntType(32)(4), present)
    return context.get_dummy_value()


def gather(values, j):
    """values[j], float32 or uint8, of every lane; absent lanes get something."""
    return values[j]


@compiled(gather, lambda values, j: (INDICES if values.dtype == types.uint8 else REALS)(values, INDICES))
def _gather(context, builder, signature, arguments):
    # one by one: a processor's own instruction for it was measured a fifth slower, and needs the indices in a register
    values = context.make_array(signature.args[0])(context, builder, arguments[0])
    found = ir.Constant(ir.VectorType(values.data.type.pointee, LANES), ir.Undefined)
    for lane, row in enumerate(each(builder, arguments[1])):
        found = builder.insert_element(found, builder.load(builder.gep(values.data, [row])), ir.IntType(32)(lane))
    if signature.return_type == REALS:
        return found
    place = cgutils.alloca_once(builder, INDICES.llvm)
    builder.store(builder.zext(found, INDICES.llvm), place)
    return place


def each(builder: Any, indices: Any) -> list[Any]:
    """The index of every lane, as 64 bits."""
    first = builder.bitcast(indices, INDICES.llvm.element.as_pointer())
    places = (builder.gep(first, [ir.IntType(64)(lane)]) for lane in range(LANES))
    return [builder.zext(builder.load(place), ir.IntType(64)) for place in places]


def gather_four(values, j, column):
    """values[j, column] to values[j, column + 3] of every lane, as four; values (N, columns), float32, row by row.

    A gather fetches lane by lane. Where four numbers lie side by side each lane is one read, and a few shuffles turn them.
    """
    return tuple(values[j, column : column + 4].T)


@compiled(gather_four, lambda values, j, column: types.UniTuple(REALS, 4)(values, INDICES, types.int64))
def _gather_four(context, builder, signature, arguments):
    values = context.make_array(signature.args[0])(context, builder, arguments[0])
    quad, columns = ir.VectorType(ir.FloatType(), 4), cgutils.unpack_tuple(builder, values.shape)[1]
    rows = []
    for row in each(builder, arguments[1]):
        place = builder.gep(values.data, [builder.add(builder.mul(row, columns), arguments[2])])
        rows.append(builder.load(builder.bitcast(place, quad.as_pointer()), align=4))
    return context.make_tuple(builder, signature.return_type, turned(builder, rows))


def turned(builder: Any, rows: list[Any]) -> list[Any]:
    """LANES vectors of four numbers as four vectors of LANES, by steps that processors have an instruction for."""

    def shuffled(left: Any, right: Any, *places: int) -> Any:
        return builder.shuffle_vector(left, right, ir.Constant(ir.VectorType(ir.IntType(32), len(places)), places))

    halves = [shuffled(rows[n], rows[n + 4], 0, 1, 2, 3, 4, 5, 6, 7) for n in range(4)]
    low, high = (0, 8, 1, 9, 4, 12, 5, 13), (2, 10, 3, 11, 6, 14, 7, 15)
    first, second = (0, 1, 8, 9, 4, 5, 12, 13), (2, 3, 10, 11, 6, 7, 14, 15)
    pairs = [(shuffled(*halves[:2], *part), shuffled(*halves[2:], *part)) for part in (low, high)]
    return [shuffled(*pair, *part) for pair in pairs for part in (first, second)]


def above_zero(lanes):
    """Which lanes are above 0."""
    return lanes > 0.0


@compiled(above_zero, lambda lanes: TRUTHS(REALS))
def _above_zero(context, builder, signature, arguments):
    return builder.fcmp_ordered(">", arguments[0], ir.Constant(REALS.llvm, None))


def only(present, lanes, otherwise):
    """`lanes` where present, the scalar `otherwise` elsewhere."""
    return np.where(present, lanes, otherwise)


@compiled(only, lambda present, lanes, otherwise: REALS(TRUTHS, REALS, REALS))
def _only(context, builder, signature, arguments):
    return builder.select(*arguments)


def spread(value):
    """A float32 in every lane; to numpy a scalar, so that `x = y = spread(0)` are two numbers under +=."""
    return np.float32(value)


@compiled(spread, lambda value: REALS(REALS))
def _spread(context, builder, signature, arguments):
    return arguments[0]


@lower_cast(types.float32, REALS)
def _cast(context, builder, source, target, value):
    return every(builder, value)


def summed(lanes):
    """Sum of the lanes, always in the same order."""
    return np.broadcast_to(lanes, LANES).sum(dtype=np.float32)


@compiled(summed, lambda lanes: types.float32(REALS))
def _summed(context, builder, signature, arguments):
    nothing = REALS.llvm.element(-0.0)
    return call(builder, f"vector.reduce.fadd.{REALS.suffix}", REALS.llvm.element, nothing, *arguments, fast=True)


def root(x):
    """Square root of a scalar or of lanes."""
    return np.sqrt(x)


def floor(x):
    """The next whole number below, for a scalar or lanes; unlike math.floor it stays a float."""
    return np.floor(x)


def rounded(x):
    """The nearest whole number, for a scalar or lanes; it stays a float."""
    return np.rint(x)


def positive(x):
    """max(x, 0) of a scalar or of lanes."""
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
    """Lanes with lanes or float32 scalars."""
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
