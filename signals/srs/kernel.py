"""The compiled loop: sixteen oscillators at a time run over a record and keep their extremes and
their last state.

One step from the base accelerations a0 to a1, with S, G, H of `coefficients` and K = G / theta:

    p += G (a0 - p) + S v + H (a1 - a0)
    v += S (a0 - p) - (G + 2 zeta S) v + K (a1 - a0)

Only what changes is added, so for small theta nothing is lost: the filter of ISO 18431-4 in its
printed form has poles that its coefficients tell from 1 by theta^2, and at theta = 1e-6 six digits
of it are left, of this form fourteen. It also gives relative displacement and absolute acceleration
from one pair of states.

Several numbers that a compiled loop treats as one: what some vector registers of the processor
hold.

Numba writes a loop over oscillators as single numbers where each step waits for the one before.
This type says it outright: `+`, `-`, `*` and the functions below act on `WIDTH` numbers at once, on
any processor LLVM knows. They may be contracted to a product and a sum with one rounding; no other
liberty is taken.

After a change here, change `kernel.py` too: what Numba keeps on disk is as old as the file with the
loop.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir  # type: ignore[import-untyped]
from numba import extending, njit, types
from numba.core import cgutils
from numba.extending import models, overload, register_model

from ...array_types import Floats
from .coefficients import Steps
from .threads import checked_threads
from .threads import over_threads as spread_over_threads

#: Two registers of AVX-512, four of AVX2: while a step in one waits for the step before, the others
#: compute.
WIDTH = 16

_VECTOR = ir.VectorType(ir.DoubleType(), WIDTH)


class SimdVector(types.Type):
    """The type of `WIDTH` doubles in compiled code; it has no value outside of it."""

    def __init__(self) -> None:
        super().__init__(name=f"Lanes({WIDTH})")


LANES = SimdVector()


@register_model(SimdVector)
class _Model(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _VECTOR)  # type: ignore[no-untyped-call]


def intrinsic(function: Callable[..., Any]) -> Any:
    """Numba's; what it makes is called with other arguments than it is written with, which no type
    tells."""
    return extending.intrinsic(function)


def _pairwise(build: Any) -> Any:
    """An intrinsic of two lanes, of the IR that `build(builder, x, y)` writes."""

    @intrinsic
    def both(typing_context: Any, x: Any, y: Any) -> Any:
        return LANES(LANES, LANES), lambda context, builder, signature, args: build(builder, *args)

    return both


def _keep(comparison: str) -> Any:
    return lambda builder, x, y: builder.select(
        builder.fcmp_ordered(comparison, x, y, flags=()), x, y
    )


_ADD = _pairwise(lambda builder, x, y: builder.fadd(x, y, flags=("contract",)))
_SUBTRACT = _pairwise(lambda builder, x, y: builder.fsub(x, y, flags=("contract",)))
_MULTIPLY = _pairwise(lambda builder, x, y: builder.fmul(x, y, flags=("contract",)))
larger = _pairwise(_keep(">"))
smaller = _pairwise(_keep("<"))


@intrinsic
def spread(typing_context: Any, value: Any) -> Any:
    """A number in every lane."""

    def build(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        inserted = builder.insert_element(
            ir.Constant(_VECTOR, ir.Undefined), args[0], ir.Constant(ir.IntType(32), 0)
        )
        zeros = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH)
        return builder.shuffle_vector(inserted, ir.Constant(_VECTOR, ir.Undefined), zeros)

    return LANES(types.float64), build


@intrinsic
def magnitude(typing_context: Any, x: Any) -> Any:
    def build(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        find: Any = cgutils.get_or_insert_function
        kind = ir.FunctionType(_VECTOR, [_VECTOR])
        return builder.call(find(builder.module, kind, f"llvm.fabs.v{WIDTH}f64"), args)

    return LANES(LANES), build


@intrinsic
def total(typing_context: Any, x: Any) -> Any:
    """The sum over the lanes, in any order."""

    def build(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        find: Any = cgutils.get_or_insert_function
        kind = ir.FunctionType(ir.DoubleType(), [ir.DoubleType(), _VECTOR])
        function = find(builder.module, kind, f"llvm.vector.reduce.fadd.v{WIDTH}f64")
        return builder.call(
            function, [ir.Constant(ir.DoubleType(), 0.0), *args], fastmath=("reassoc",)
        )

    return types.float64(LANES), build


def _address(context: Any, builder: Any, kind: Any, array: Any, row: Any) -> Any:
    struct = context.make_array(kind)(context, builder, array)
    start = builder.mul(row, ir.Constant(row.type, WIDTH))
    return builder.bitcast(builder.gep(struct.data, [start]), _VECTOR.as_pointer())


@intrinsic
def load(typing_context: Any, table: Any, row: Any) -> Any:
    """Row of a contiguous (rows, WIDTH)."""

    def build(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.load(_address(context, builder, signature.args[0], *args), align=8)

    return LANES(table, types.intp), build


@intrinsic
def store(typing_context: Any, table: Any, row: Any, value: Any) -> Any:
    """Into a row of a contiguous (rows, WIDTH)."""

    def build(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        builder.store(args[2], _address(context, builder, signature.args[0], *args[:2]), align=8)
        return context.get_dummy_value()

    return types.void(table, types.intp, LANES), build


@overload(operator.add, strict=False)
def _add(x: Any, y: Any) -> Any:
    return (lambda x, y: _ADD(x, y)) if x is LANES and y is LANES else None


@overload(operator.sub, strict=False)
def _subtract(x: Any, y: Any) -> Any:
    return (lambda x, y: _SUBTRACT(x, y)) if x is LANES and y is LANES else None


@overload(operator.mul, strict=False)
def _multiply(x: Any, y: Any) -> Any:
    return (lambda x, y: _MULTIPLY(x, y)) if x is LANES and y is LANES else None


_COEFFICIENTS, _FOUND = 5, 5
#: Zeros in a record let the states decay to subnormal numbers, on which processors are slow; this,
#: with its sign changing at every sample, keeps them above. It is lost in the last digit of every
#: other sample.
_DITHER = 1e-200
#: Less work than this, in steps of one oscillator, is done before another thread has begun.
_WORTH_A_THREAD = 400_000


def run(records: Floats, oscillators: Steps, threads: int | None = None) -> Floats:
    """Records (k, n) over f oscillators: (5, k, f) of max x, min x (>= 0 and <= 0), max |p|; p and
    v at the end.

    The first three are of the samples of the record, x being p + 2 zeta v; the last two are of one
    step later, where the base is at 0.
    """
    k, f = len(records), oscillators.theta.size
    table = _blocks(oscillators)
    extremes = np.empty((k, len(table), _FOUND, WIDTH))
    tasks, twice_zeta = k * len(table), 2 * oscillators.damping_ratio
    most = min(checked_threads(threads), 1 + tasks * WIDTH * records.shape[1] // _WORTH_A_THREAD)
    spread_over_threads(
        lambda start, stop: _run_tasks(records, table, twice_zeta, start, stop, extremes),
        tasks,
        most,
    )
    return extremes.transpose(2, 0, 1, 3).reshape(_FOUND, k, -1)[..., :f]


def _blocks(steps: Steps) -> Floats:
    """Coefficients (blocks, 5, WIDTH); the last oscillator fills up the last block."""
    rows = np.stack(
        [
            steps.g,
            steps.s,
            steps.h,
            -steps.g - 2 * steps.damping_ratio * steps.s,
            steps.g / steps.theta,
        ]
    )
    f = steps.theta.size
    filled = np.minimum(np.arange(-(-f // WIDTH) * WIDTH), f - 1)
    return np.ascontiguousarray(
        rows[:, filled].reshape(_COEFFICIENTS, -1, WIDTH).transpose(1, 0, 2)
    )


@njit(nogil=True)
def _first_sample(record):  # type: ignore[no-untyped-def]
    """The first that is not 0: until then all is at rest."""
    for i in range(record.size):
        if record[i] != 0.0:
            return i
    return record.size


@njit(nogil=True)
def _run_block(record, table, twice_zeta, extremes):  # type: ignore[no-untyped-def]
    g, s, h, m, k = load(table, 0), load(table, 1), load(table, 2), load(table, 3), load(table, 4)
    p = v = highest = lowest = furthest = spread(0.0)
    damping, before, dither = spread(twice_zeta), 0.0, _DITHER
    for sample in record[_first_sample(record) :]:
        now = sample + dither
        dither = -dither
        error, rise = spread(before) - p, spread(now - before)
        p, v = g * error + (s * v + (h * rise + p)), s * error + (m * v + (k * rise + v))
        x = p + damping * v
        highest, lowest, furthest = (
            larger(x, highest),
            smaller(x, lowest),
            larger(magnitude(p), furthest),
        )
        before = now
    error, rise = spread(before) - p, spread(-before)
    p, v = g * error + (s * v + (h * rise + p)), s * error + (m * v + (k * rise + v))
    for row, value in enumerate((highest, lowest, furthest, p, v)):
        store(extremes, row, value)


@njit("(f8[:, ::1], f8[:, :, ::1], f8, i8, i8, f8[:, :, :, ::1])", nogil=True, cache=True)
def _run_tasks(records, table, twice_zeta, start, stop, extremes):  # type: ignore[no-untyped-def]
    """Tasks count all blocks of the first record, then of the next."""
    for task in range(start, stop):
        i, block = task // len(table), task % len(table)
        _run_block(records[i], table[block], twice_zeta, extremes[i, block])


@njit("(f8[::1], f8, f8, f8, f8, f8, f8[:, ::1])", nogil=True, cache=True)
def run_series(record, g, s, h, k, twice_zeta, series):  # type: ignore[no-untyped-def]
    """p and v of one oscillator at each sample into `series` (2, n)."""
    p = v = before = 0.0
    for i, now in enumerate(record):
        error, rise = before - p, now - before
        p, v = (
            p + (g * error + (s * v + h * rise)),
            v + (s * error - (g + twice_zeta * s) * v + k * rise),
        )
        series[0, i], series[1, i] = p, v
        before = now
