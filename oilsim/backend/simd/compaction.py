"""The innermost loops of the neighbour search: collect what lies near a box, and append to a list what of it lies within a ball.

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


class Box(NamedTuple):
    """A box around several places: its middle (x, y, z) [m], half its edges (3,) [m], and the squared distance [m2] that counts as near.

    All are float32; period as that of a `Ball`.
    """

    middle: tuple[np.float32, np.float32, np.float32]
    half: tuple[np.float32, np.float32, np.float32]
    reach_squared: np.float32
    period: tuple[np.float32, np.float32, np.float32] | None


class Ball(NamedTuple):
    """The ball in which neighbours lie: place (x, y, z) of its centre [m] and its squared radius [m2], float32.

    own     index of the candidate that is the centre itself and does not count; -1 if there is none
    period  lengths of the periodic axes [m], 0 where space is open; None if all is
    """

    place: tuple[np.float32, np.float32, np.float32]
    own: int
    reach_squared: np.float32
    period: tuple[np.float32, np.float32, np.float32] | None


class Candidates(NamedTuple):
    """Room for the candidates near a box: index (C,) uint32, and position (3, C) float32 [m]."""

    index: Any
    position: Any


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


def _squared_distance(builder: Any, place: Any, half: Any, period: Any, theirs: list[Any]) -> Any:
    """Return the squared distances [m2] of candidates at `theirs`, by axis, from a place, or from the box of half edges around it."""
    square, nothing = constant(REALS, 0.0), constant(REALS, 0.0)
    for axis in range(3):
        delta = builder.fsub(every(builder, builder.extract_value(place, axis), REALS), theirs[axis])
        if period is not None:
            delta = _nearest_image(builder, delta, builder.extract_value(period, axis))
        if half is not None:
            away = call(builder, f"fabs.{REALS.suffix}", REALS.llvm, delta)
            away = builder.fsub(away, every(builder, builder.extract_value(half, axis), REALS))
            delta = builder.select(builder.fcmp_ordered(">", away, nothing), away, nothing)
        square = builder.fadd(square, builder.fmul(delta, delta))
    return square


def _pack(builder: Any, near: Any, packed: list[tuple[Any, Any]]) -> Any:
    """Store the `near` lanes of each vector from its place on, for pairs of vectors and places, and return their number."""
    bits = builder.bitcast(near, ir.IntType(LANES))
    if PERMUTES:
        table = cgutils.global_constant(builder.module, "oilsim.packed_lanes", _packed_lanes())
        order = builder.load(builder.gep(table, [LONG(0), builder.zext(bits, LONG)]), align=4)
    for vector, place in packed:
        lanes = builder.bitcast(vector, INDICES.llvm)
        if PERMUTES:
            together = call(builder, "x86.avx2.permd", INDICES.llvm, lanes, order)
        else:
            nothing = ir.Constant(INDICES.llvm, ir.Undefined)
            name = f"experimental.vector.compress.{INDICES.suffix}"
            together = call(builder, name, INDICES.llvm, lanes, near, nothing)
        builder.store(together, builder.bitcast(place, INDICES.llvm.as_pointer()), align=4)
    return builder.zext(builder.ctpop(bits), LONG)


def _packed_lanes() -> Any:
    """Return, for each set of lanes as the bits of a number, the order in which these lanes come first."""
    orders = [[lane for lane in range(LANES) if bits >> lane & 1] for bits in range(1 << LANES)]
    rows = [ir.Constant(INDICES.llvm, order + [0] * (LANES - len(order))) for order in orders]
    return ir.Constant(ir.ArrayType(INDICES.llvm, len(rows)), rows)


def _present(builder: Any, k: Any, last: Any) -> Any:
    """Return which of the places k to k + LANES lie below `last`."""
    left = builder.trunc(builder.sub(last, k), INT)
    return builder.icmp_signed("<", numbered(INDICES), every(builder, left, INDICES))


def _from(builder: Any, array: Any, axis: int, place: Any) -> Any:
    """Return the address of array[axis, place]."""
    pitch = cgutils.unpack_tuple(builder, array.shape)[1]
    return builder.gep(array.data, [builder.add(builder.mul(pitch, LONG(axis)), place)])


def _collect_lanes(typing_context, box, other, candidate, k, last, found, count):
    """Collect those of the candidates k to k + LANES, below last, that are near the box; returns their number."""
    listed, open_space = not isinstance(candidate, types.NoneType), isinstance(box.types[3], types.NoneType)

    def generate(context, builder, signature, arguments):
        box, points, candidates, k, last, found, count = arguments
        points = context.make_array(signature.args[1])(context, builder, points)
        index, position = (
            context.make_array(kind)(context, builder, builder.extract_value(found, n))
            for n, kind in enumerate(signature.args[5].types)
        )
        present = _present(builder, k, last)
        chosen = builder.add(numbered(INDICES), every(builder, builder.trunc(k, INT), INDICES))
        if listed:
            list_ = context.make_array(signature.args[2])(context, builder, candidates)
            chosen = masked_load(builder, list_.data, k, INDICES, present)
            theirs = [
                _masked_gather(builder, _from(builder, points, axis, LONG(0)), chosen, present) for axis in range(3)
            ]
        else:
            theirs = [
                masked_load(builder, _from(builder, points, axis, LONG(0)), k, REALS, present) for axis in range(3)
            ]
        middle, half, limit, period = (builder.extract_value(box, n) for n in range(4))
        square = _squared_distance(builder, middle, half, None if open_space else period, theirs)
        near = builder.and_(builder.fcmp_ordered("<", square, every(builder, limit, REALS)), present)
        packed = [(theirs[axis], _from(builder, position, axis, count)) for axis in range(3)]
        return _pack(builder, near, [*packed, (chosen, builder.gep(index.data, [count]))])

    return types.int64(box, other, candidate, k, last, found, count), generate


def _append_lanes(typing_context, ball, found, k, count, index, cursor):
    """Append those of the candidates k to k + LANES, below count, that are in the ball; returns their number."""
    open_space = isinstance(ball.types[3], types.NoneType)

    def generate(context, builder, signature, arguments):
        ball, found, k, count, target, cursor = arguments
        listed, position = (
            context.make_array(kind)(context, builder, builder.extract_value(found, n))
            for n, kind in enumerate(signature.args[1].types)
        )
        target = context.make_array(signature.args[4])(context, builder, target)
        present = _present(builder, k, count)
        chosen = masked_load(builder, listed.data, k, INDICES, present)
        theirs = [masked_load(builder, _from(builder, position, axis, LONG(0)), k, REALS, present) for axis in range(3)]
        place, own, limit, period = (builder.extract_value(ball, n) for n in range(4))
        square = _squared_distance(builder, place, None, None if open_space else period, theirs)
        own = every(builder, builder.trunc(own, INT), INDICES)
        present = builder.and_(present, builder.icmp_unsigned("!=", chosen, own))
        near = builder.and_(builder.fcmp_ordered("<", square, every(builder, limit, REALS)), present)
        return _pack(builder, near, [(chosen, builder.gep(target.data, [cursor]))])

    return types.int64(ball, found, k, count, index, cursor), generate


_collect, _append = intrinsic(_collect_lanes), intrinsic(_append_lanes)


def _separation(place, position, period):
    """Return `place` (3,) less `position` (3,) [m] under the nearest image, in plain Python."""
    delta = np.array(place, np.float32) - position
    for axis, length in enumerate(period or ()):
        if length > 0.0:
            delta[axis] -= length * np.floor(delta[axis] / length + np.float32(0.5))
    return delta


def collect_one_by_one(box, other, candidate, first, last, found, count):
    """Collect as `collect_near` does, in plain Python, for runs with the compiler switched off."""
    for k in range(first, last):
        j = k if candidate is None else int(candidate[k])
        away = np.maximum(
            np.abs(_separation(box.middle, other[:, j], box.period)) - np.array(box.half, np.float32), 0.0
        )
        if np.float32((away * away).sum()) < box.reach_squared:
            found.index[count], found.position[:, count] = j, other[:, j]
            count += 1
    return count


def append_one_by_one(ball, found, count, index, cursor):
    """Append as `append_near` does, in plain Python, for runs with the compiler switched off."""
    for k in range(count):
        delta = _separation(ball.place, found.position[:, k], ball.period)
        if found.index[k] != ball.own and np.float32((delta * delta).sum()) < ball.reach_squared:
            index[cursor] = found.index[k]
            cursor += 1
    return cursor


@inlined
def collect_near(box, other, candidate, first, last, found, count):
    """Collect the candidates near a `Box`, behind the first `count` of the `Candidates` found, and return the number with them.

    other (3, M): positions [m]; candidates are candidate[first:last], or first to last themselves if `candidate` is None. Up to LANES
    places behind the last one may be overwritten.
    """
    for k in range(first, last, LANES):
        count += _collect(box, other, candidate, k, last, found, count)
    return count


@inlined
def append_near(ball, found, count, index, cursor):
    """Append to `index` (places,), from place `cursor` on, those of the first `count` of `Candidates` that lie within the `Ball`.

    Returns the cursor after the last one. Up to LANES places behind the last one may be overwritten, never a place beyond those that all
    candidates would fill, rounded up to whole LANES.
    """
    for k in range(0, count, LANES):
        cursor += _append(ball, found, k, count, index, cursor)
    return cursor


if config.DISABLE_JIT:
    collect_near, append_near = collect_one_by_one, append_one_by_one
