"""The innermost loop of the neighbour search: append to a list those candidates that lie within a ball.

Compilers do not vectorise a loop that sometimes appends. So LANES candidates are compared at once, and the near ones are packed together
in a register: in one instruction where the processor has it (AVX-512, 16 lanes), in the order of a table where it permutes lanes (AVX2, 8
lanes), else as LLVM spells it out. Against a plain loop the first was measured 4 to 5 times faster, and the last 1.1 times.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from llvmlite import binding, ir
from numba import config, types
from numba.core import cgutils
from numba.extending import intrinsic

from oilsim.backend.jit import inlined
from oilsim.backend.simd import types as vectors
from oilsim.backend.simd.memory import masked_load
from oilsim.backend.simd.types import INT, LONG, call, constant, every, numbered

PACKS = bool(binding.get_host_cpu_features().get("avx512f", False))  # whether the processor packs in one instruction
# [numbers] of a vector that the search packs; theory; as many as AVX-512 packs in one instruction, else as many as kernels take
LANES = 16 if PACKS else vectors.LANES
# whether the processor permutes lanes by a vector, in one instruction
PERMUTES = not PACKS and LANES == 8 and bool(binding.get_host_cpu_features().get("avx2", False))

REALS, INDICES = vectors.reals(LANES), vectors.indices(LANES)


class Ball(NamedTuple):
    """The ball in which neighbours lie: place (x, y, z) of its centre [m] and its squared radius [m2], float32.

    own     index of the candidate that is the centre itself and does not count; -1 if there is none
    period  lengths of the periodic axes [m], 0 where space is open; None if all is
    """

    place: tuple[np.float32, np.float32, np.float32]
    own: int
    reach_squared: np.float32
    period: tuple[np.float32, np.float32, np.float32] | None


def _masked_gather(builder: Any, base: Any, chosen: Any, present: Any) -> Any:
    """Return the numbers base[chosen] where `present`, 0 elsewhere, by the processor's own instruction."""
    places = builder.gep(base, [builder.zext(chosen, ir.VectorType(LONG, LANES))], source_etype=ir.FloatType())
    places.type = ir.VectorType(ir.PointerType(ir.FloatType()), LANES)  # llvmlite types an address from one index only
    name = f"masked.gather.{REALS.suffix}.v{LANES}p0"
    return call(builder, name, REALS.llvm, places, INT(4), present, constant(REALS, 0))


def _nearest_image(builder: Any, delta: Any, period: Any) -> Any:
    """Return delta - period floor(delta / period + 1/2), or delta itself where the period is 0.

    The rounding of the quotient matters at half a period alone, where nothing is near.
    """
    length = every(builder, period, REALS)
    inverse = builder.fdiv(constant(REALS, 1.0), length)  # once for all rounds of a loop
    turns = builder.fadd(builder.fmul(delta, inverse), constant(REALS, 0.5))
    whole = call(builder, f"floor.{REALS.suffix}", REALS.llvm, turns)
    wrapped = builder.fsub(delta, builder.fmul(length, whole))
    return builder.select(builder.fcmp_ordered(">", length, constant(REALS, 0.0)), wrapped, delta)


def _squared_distance(builder: Any, ball: Any, load_row: Any, open_space: bool) -> Any:
    """Return the squared distances [m2] of the candidates whose coordinates `load_row(axis)` returns."""
    place, periods = builder.extract_value(ball, 0), builder.extract_value(ball, 3)
    square = constant(REALS, 0.0)
    for axis in range(3):
        theirs = load_row(axis)
        delta = builder.fsub(every(builder, builder.extract_value(place, axis), REALS), theirs)
        if not open_space:
            delta = _nearest_image(builder, delta, builder.extract_value(periods, axis))
        square = builder.fadd(square, builder.fmul(delta, delta))
    return square


def _pack(builder: Any, chosen: Any, near: Any, place: Any) -> Any:
    """Store the `near` ones of the indices `chosen` from `place` on, and return their number."""
    bits = builder.bitcast(near, ir.IntType(LANES))
    if PERMUTES:
        table = cgutils.global_constant(builder.module, "oilsim.packed_lanes", _packed_lanes())
        order = builder.load(builder.gep(table, [LONG(0), builder.zext(bits, LONG)]), align=4)
        packed = call(builder, "x86.avx2.permd", INDICES.llvm, chosen, order)
    else:
        nothing = ir.Constant(INDICES.llvm, ir.Undefined)
        packed = call(builder, f"experimental.vector.compress.{INDICES.suffix}", INDICES.llvm, chosen, near, nothing)
    builder.store(packed, builder.bitcast(place, INDICES.llvm.as_pointer()), align=4)
    return builder.zext(builder.ctpop(bits), LONG)


def _packed_lanes() -> Any:
    """Return, for each set of lanes as the bits of a number, the order in which these lanes come first."""
    orders = [[lane for lane in range(LANES) if bits >> lane & 1] for bits in range(1 << LANES)]
    rows = [ir.Constant(INDICES.llvm, order + [0] * (LANES - len(order))) for order in orders]
    return ir.Constant(ir.ArrayType(INDICES.llvm, len(rows)), rows)


def _append_lanes(typing_context, ball, other, candidate, k, last, index, cursor):
    """Append the near ones of candidates k to k + LANES, below last; returns their number."""
    contiguous, open_space = isinstance(candidate, types.NoneType), isinstance(ball.types[3], types.NoneType)

    def generate(context, builder, signature, arguments):
        ball, points, candidates, k, last, target, cursor = arguments
        points = context.make_array(signature.args[1])(context, builder, points)
        target = context.make_array(signature.args[5])(context, builder, target)
        left = builder.trunc(builder.sub(last, k), INT)
        present = builder.icmp_signed("<", numbered(INDICES), every(builder, left, INDICES))
        if contiguous:
            chosen = builder.add(numbered(INDICES), every(builder, builder.trunc(k, INT), INDICES))
        else:
            list_ = context.make_array(signature.args[2])(context, builder, candidates)
            chosen = masked_load(builder, list_.data, k, INDICES, present)
        pitch = cgutils.unpack_tuple(builder, points.shape)[1]

        def load_row(axis: int) -> Any:
            row = builder.gep(points.data, [builder.mul(pitch, LONG(axis))])
            if contiguous:
                return masked_load(builder, row, k, REALS, present)
            return _masked_gather(builder, row, chosen, present)

        square = _squared_distance(builder, ball, load_row, open_space)
        limit = every(builder, builder.extract_value(ball, 2), REALS)
        own = every(builder, builder.trunc(builder.extract_value(ball, 1), INT), INDICES)
        present = builder.and_(present, builder.icmp_unsigned("!=", chosen, own))
        near = builder.and_(builder.fcmp_ordered("<", square, limit), present)
        return _pack(builder, chosen, near, builder.gep(target.data, [cursor]))

    parameters = (ball, other, candidate, k, last, index, cursor)
    return types.int64(*parameters), generate


_append = intrinsic(_append_lanes)


def append_one_by_one(ball, other, candidate, first, last, index, cursor):
    """Append as `append_near` does, in plain Python, for runs with the compiler switched off."""
    for k in range(first, last):
        j = k if candidate is None else int(candidate[k])
        delta = np.array(ball.place, np.float32) - other[:, j]
        for axis, length in enumerate(ball.period or ()):
            if length > 0.0:
                delta[axis] -= length * np.floor(delta[axis] / length + np.float32(0.5))
        square = np.float32((delta * delta).sum())
        if j != ball.own and square < ball.reach_squared:
            index[cursor] = j
            cursor += 1
    return cursor


@inlined
def append_near(ball, other, candidate, first, last, index, cursor):
    """Append to `index` (places,), from place `cursor` on, the candidates within the `ball` (see `Ball`).

    other (3, M): positions [m]; candidates are candidate[first:last], or first to last themselves if `candidate` is None.

    Returns the cursor after the last one. Up to LANES places behind the last one may be overwritten, never a place beyond those that all
    candidates would fill, rounded up to whole LANES.
    """
    for k in range(first, last, LANES):
        cursor += _append(ball, other, candidate, k, last, index, cursor)
    return cursor


if config.DISABLE_JIT:
    append_near = append_one_by_one
