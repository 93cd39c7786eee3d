"""The innermost loop of the neighbour search: append to a list those candidates that lie within reach of a point.

A loop that sometimes appends is not vectorised by compilers, so it is written with LLVM's portable vector operations: LANES
candidates are compared at once and the near ones packed together in a register. Against a plain loop it is measured 4 to 5
times faster where the processor has an instruction for the packing (AVX-512), and 1.1 times where LLVM spells it out (AVX2).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import binding, ir
from numba import config, types
from numba.core import cgutils
from numba.extending import intrinsic

from oilsim.backend.jit import inlined

PACKS = bool(binding.get_host_cpu_features().get("avx512f", False))  # the processor packs in one instruction
LANES = 16 if PACKS else 8
FAR = np.float32(3e38)

_INT, _LONG = ir.IntType(32), ir.IntType(64)
_INTS, _LONGS = ir.VectorType(_INT, LANES), ir.VectorType(_LONG, LANES)
_REALS = ir.VectorType(ir.FloatType(), LANES)
_POINTERS = ir.VectorType(ir.PointerType(ir.FloatType()), LANES)
_LANE = ir.Constant(_INTS, list(range(LANES)))
_NOBODY = ir.Constant(_INTS, [0] * LANES)


def _reals(value: float) -> Any:
    return ir.Constant(_REALS, [value] * LANES)


def _call(builder: Any, name: str, result: Any, *arguments: Any) -> Any:
    """Call an operation of LLVM by its name."""
    signature = ir.FunctionType(result, [argument.type for argument in arguments])
    return builder.call(cgutils.get_or_insert_function(builder.module, signature, f"llvm.{name}"), arguments)


def _spread(builder: Any, value: Any, vector: Any) -> Any:
    """A scalar in every lane."""
    nothing = ir.Constant(vector, ir.Undefined)
    return builder.shuffle_vector(builder.insert_element(nothing, value, _INT(0)), nothing, _NOBODY)


def _load(builder: Any, base: Any, first: Any, vector: Any, present: Any) -> Any:
    """The elements base[first + lane] where `present`, 0 elsewhere."""
    place = builder.bitcast(builder.gep(base, [first]), vector.as_pointer())
    name = f"masked.load.v{LANES}{'f' if vector is _REALS else 'i'}32.p0"
    return _call(builder, name, vector, place, _INT(4), present, _reals(0.0) if vector is _REALS else _NOBODY)


def _gather(builder: Any, base: Any, chosen: Any, present: Any) -> Any:
    """The elements base[chosen] where `present`, 0 elsewhere."""
    places = builder.gep(base, [builder.zext(chosen, _LONGS)], source_etype=ir.FloatType())
    places.type = _POINTERS  # llvmlite types an address from one index only
    return _call(builder, f"masked.gather.v{LANES}f32.v{LANES}p0", _REALS, places, _INT(4), present, _reals(0.0))


def _nearest_image(builder: Any, delta: Any, period: Any) -> Any:
    """delta - period floor(delta / period + 1/2), or delta itself where the period is 0."""
    length = _spread(builder, period, _REALS)
    turns = builder.fadd(builder.fdiv(delta, length), _reals(0.5))
    wrapped = builder.fsub(delta, builder.fmul(length, _call(builder, f"floor.v{LANES}f32", _REALS, turns)))
    return builder.select(builder.fcmp_ordered(">", length, _reals(0.0)), wrapped, delta)


def _append_lanes(typing_context, other, candidate, k, last, own, x, y, z, period, reach_squared, index, cursor):
    """Append the near ones of candidates k to k + LANES, below last; returns their number and the margin."""
    parameters = (other, candidate, k, last, own, x, y, z, period, reach_squared, index, cursor)
    contiguous, open_space = isinstance(candidate, types.NoneType), isinstance(period, types.NoneType)

    def generate(context, builder, signature, arguments):
        points, candidates, k, last, own, x, y, z, periods, reach, target, cursor = arguments
        points, target = (
            context.make_array(signature.args[n])(context, builder, v) for n, v in ((0, points), (10, target))
        )
        present = builder.icmp_signed("<", _LANE, _spread(builder, builder.trunc(builder.sub(last, k), _INT), _INTS))
        if contiguous:
            chosen = builder.add(_LANE, _spread(builder, builder.trunc(k, _INT), _INTS))
        else:
            list_ = context.make_array(signature.args[1])(context, builder, candidates)
            chosen = _load(builder, list_.data, k, _INTS, present)
        pitch, square = cgutils.unpack_tuple(builder, points.shape)[1], _reals(0.0)
        for axis, coordinate in enumerate((x, y, z)):
            row = builder.gep(points.data, [builder.mul(pitch, _LONG(axis))])
            theirs = _load(builder, row, k, _REALS, present) if contiguous else _gather(builder, row, chosen, present)
            delta = builder.fsub(_spread(builder, coordinate, _REALS), theirs)
            if not open_space:
                delta = _nearest_image(builder, delta, builder.extract_value(periods, axis))
            square = builder.fadd(square, builder.fmul(delta, delta))
        limit = _spread(builder, reach, _REALS)
        another = builder.icmp_unsigned("!=", chosen, _spread(builder, builder.trunc(own, _INT), _INTS))
        present = builder.and_(present, another)
        near = builder.and_(builder.fcmp_ordered("<", square, limit), present)
        nothing = ir.Constant(_INTS, ir.Undefined)
        packed = _call(builder, f"experimental.vector.compress.v{LANES}i32", _INTS, chosen, near, nothing)
        builder.store(packed, builder.bitcast(builder.gep(target.data, [cursor]), _INTS.as_pointer()), align=4)
        number = builder.zext(builder.ctpop(builder.bitcast(near, ir.IntType(LANES))), _LONG)
        margin = _call(builder, f"fabs.v{LANES}f32", _REALS, builder.fsub(square, limit))
        margin = builder.select(present, margin, _reals(float(FAR)))
        margin = _call(builder, f"vector.reduce.fmin.v{LANES}f32", ir.FloatType(), margin)
        return context.make_tuple(builder, signature.return_type, (number, margin))

    return types.Tuple((types.int64, types.float32))(*parameters), generate


_append = intrinsic(_append_lanes)


def append_one_by_one(other, candidate, first, last, own, x, y, z, period, reach_squared, index, cursor):
    """`append_near` in plain Python, for runs with the compiler switched off."""
    margin = FAR
    for k in range(first, last):
        j = k if candidate is None else int(candidate[k])
        delta = np.array([x, y, z], np.float32) - other[:, j]
        for axis, length in enumerate(period or ()):
            if length > 0.0:
                delta[axis] -= length * np.floor(delta[axis] / length + np.float32(0.5))
        square = np.float32((delta * delta).sum())
        if j != own:
            margin = min(margin, abs(square - reach_squared))
            if square < reach_squared:
                index[cursor] = j
                cursor += 1
    return cursor, margin


@inlined
def append_near(other, candidate, first, last, own, x, y, z, period, reach_squared, index, cursor):
    """Append to `index`, from place `cursor` on, the candidates nearer to (x, y, z) than the reach.

    other      positions (3, M) [m]
    candidate  the candidates are candidate[first:last], or first to last themselves if None
    own        index in `other` that is the point itself and does not count; -1 if there is none
    period     lengths of the periodic axes [m], 0 where space is open; None if all is

    Returns the cursor after the last, and the least | r^2 - reach^2 | [m2] over all candidates. Up to LANES places behind the
    last may be overwritten, never a place beyond those that all candidates would fill, rounded up to whole LANES.
    """
    margin = FAR
    for k in range(first, last, LANES):
        number, least = _append(other, candidate, k, last, own, x, y, z, period, reach_squared, index, cursor)
        cursor += number
        margin = min(margin, least)
    return cursor, margin


if config.DISABLE_JIT:
    append_near = append_one_by_one
