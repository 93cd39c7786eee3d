"""Lanes from memory and to it: places of a list that exist, loads, stores and gathers.

Every function stands here twice: as Python and numpy run it where the compiler is switched off, and as LLVM does.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils

from oilsim.backend.simd.types import (
    INDICES,
    INT,
    LANES,
    LONG,
    REALS,
    TRUTHS,
    Vector,
    call,
    compiled,
    constant,
    every,
    numbered,
)

# [bytes] by which reads of lists are announced; measured; processors that also gather waited for half of a pass
AHEAD = 2048
ELEMENTS = {types.float32: REALS, types.uint32: INDICES, types.int16: REALS}
SHORTS = ir.VectorType(ir.IntType(16), LANES)


def masked_load(builder: Any, base: Any, first: Any, vector: Vector, present: Any) -> Any:
    """Return the elements base[first + lane] where `present`, 0 elsewhere."""
    place = builder.bitcast(builder.gep(base, [first]), vector.llvm.as_pointer())
    return call(builder, f"masked.load.{vector.suffix}.p0", vector.llvm, place, INT(4), present, constant(vector, 0))


def fetch_ahead(builder: Any, base: Any, first: Any) -> None:
    """Request the line of memory AHEAD bytes behind base[first], which is harmless beyond an array's end."""
    byte = ir.IntType(8).as_pointer()
    place = builder.gep(builder.bitcast(builder.gep(base, [first]), byte), [LONG(AHEAD)])
    read, keep, data = INT(0), INT(3), INT(1)
    call(builder, "prefetch.p0", ir.VoidType(), place, read, keep, data)


def below(last, k):
    """Return which of the places k to k + LANES lie below `last`."""
    return k + np.arange(LANES) < last


@compiled(below, lambda last, k: TRUTHS(types.int64, types.int64))
def _below(context, builder, signature, arguments):
    left = builder.trunc(builder.sub(*arguments), INT)
    return builder.icmp_signed(">", every(builder, left, INDICES), numbered(INDICES))


def load(values, k, present):
    """Return values[k + lane] where `present`, 0 elsewhere; values (K,) are float32, uint32 or int16, and contiguous.

    Numbers of 16 bits become float32. They, and indices (uint32), are read LANES at a time: so many must lie in the array from k on, and
    absent indices, which may be gathered too, must exist (see `list_building.end_list`).
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
    """Set values[k + lane] = lanes where `present`; an array of int16, which takes whole numbers, is written in absent lanes too."""
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
    call(builder, f"masked.store.{vector.suffix}.p0", ir.VoidType(), lanes, place, INT(4), present)
    return context.get_dummy_value()


def gather(values, j):
    """Return values[j] of every lane's index j; values (N,) are float32 or uint8, and absent lanes hold any of them."""
    return values[j]


@compiled(gather, lambda values, j: (INDICES if values.dtype == types.uint8 else REALS)(values, INDICES))
def _gather(context, builder, signature, arguments):
    # one by one: a processor's own instruction was measured a fifth slower, and needs the indices in a register
    values = context.make_array(signature.args[0])(context, builder, arguments[0])
    found = ir.Constant(ir.VectorType(values.data.type.pointee, LANES), ir.Undefined)
    for lane, row in enumerate(each(builder, arguments[1])):
        found = builder.insert_element(found, builder.load(builder.gep(values.data, [row])), INT(lane))
    if signature.return_type == REALS:
        return found
    place = cgutils.alloca_once(builder, INDICES.llvm)
    builder.store(builder.zext(found, INDICES.llvm), place)
    return place


def each(builder: Any, indices: Any) -> list[Any]:
    """Return the index of every lane, as 64 bits."""
    first = builder.bitcast(indices, INDICES.llvm.element.as_pointer())
    places = (builder.gep(first, [LONG(lane)]) for lane in range(LANES))
    return [builder.zext(builder.load(place), LONG) for place in places]


def gather_four(values, j, column):
    """Return values[j, column] to values[j, column + 3] of every lane's index j, as four; values (N, columns) float32, row by row.

    Four numbers side by side are one read for each lane, and a few shuffles turn rows into lanes; `gather` would read four times.
    """
    return tuple(values[j, column : column + 4].T)


@compiled(gather_four, lambda values, j, column: types.UniTuple(REALS, 4)(values, INDICES, types.int64))
def _gather_four(context, builder, signature, arguments):
    values = context.make_array(signature.args[0])(context, builder, arguments[0])
    quad, columns = ir.VectorType(ir.FloatType(), 4), cgutils.unpack_tuple(builder, values.shape)[1]
    shift = builder.cttz(columns, ir.Constant(ir.IntType(1), 1))  # multiplications are slower
    rows = []
    for row in each(builder, arguments[1]):
        place = builder.gep(values.data, [builder.add(builder.shl(row, shift), arguments[2])])
        rows.append(builder.load(builder.bitcast(place, quad.as_pointer()), align=4))
    return context.make_tuple(builder, signature.return_type, turned(builder, rows))


def turned(builder: Any, rows: list[Any]) -> list[Any]:
    """Turn LANES vectors of four numbers into four vectors of LANES, by shuffles that processors have an instruction for."""

    def shuffled(left: Any, right: Any, *places: int) -> Any:
        return builder.shuffle_vector(left, right, ir.Constant(ir.VectorType(INT, len(places)), places))

    halves = [shuffled(rows[n], rows[n + 4], 0, 1, 2, 3, 4, 5, 6, 7) for n in range(4)]
    low, high = (0, 8, 1, 9, 4, 12, 5, 13), (2, 10, 3, 11, 6, 14, 7, 15)
    first, second = (0, 1, 8, 9, 4, 5, 12, 13), (2, 3, 10, 11, 6, 7, 14, 15)
    pairs = [(shuffled(*halves[:2], *part), shuffled(*halves[2:], *part)) for part in (low, high)]
    return [shuffled(*pair, *part) for pair in pairs for part in (first, second)]
