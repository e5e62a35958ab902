"""Several numbers that a compiled loop treats as one: what some vector registers of the processor hold.

Numba writes a loop over oscillators as single numbers where each step waits for the one before. This type says it
outright: `+`, `-`, `*` and the functions below act on `WIDTH` numbers at once, on any processor LLVM knows. They may
be contracted to a product and a sum with one rounding; no other liberty is taken.

After a change here, change `kernel.py` too: what Numba keeps on disk is as old as the file with the loop.
"""

# ruff: noqa: ARG001, ARG005 - Numba hands every builder more than it needs, by position

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir  # type: ignore[import-untyped]
from numba import extending, types
from numba.core import cgutils
from numba.extending import models, overload, register_model

#: Two registers of AVX-512, four of AVX2: while a step in one waits for the step before, the others compute.
WIDTH = 16

_VECTOR = ir.VectorType(ir.DoubleType(), WIDTH)


class Lanes(types.Type):
    """The type of `WIDTH` doubles in compiled code; it has no value outside of it."""

    def __init__(self) -> None:
        super().__init__(name=f"Lanes({WIDTH})")


LANES = Lanes()


@register_model(Lanes)
class _Model(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _VECTOR)  # type: ignore[no-untyped-call]


def intrinsic(function: Callable[..., Any]) -> Any:
    """Numba's; what it makes is called with other arguments than it is written with, which no type tells."""
    return extending.intrinsic(function)


def _pairwise(build: Any) -> Any:
    """An intrinsic of two lanes, of the IR that `build(builder, x, y)` writes."""

    @intrinsic
    def both(typing_context: Any, x: Any, y: Any) -> Any:
        return LANES(LANES, LANES), lambda context, builder, signature, args: build(builder, *args)

    return both


def _keep(comparison: str) -> Any:
    return lambda builder, x, y: builder.select(builder.fcmp_ordered(comparison, x, y, flags=()), x, y)


_ADD = _pairwise(lambda builder, x, y: builder.fadd(x, y, flags=("contract",)))
_SUBTRACT = _pairwise(lambda builder, x, y: builder.fsub(x, y, flags=("contract",)))
_MULTIPLY = _pairwise(lambda builder, x, y: builder.fmul(x, y, flags=("contract",)))
larger = _pairwise(_keep(">"))
smaller = _pairwise(_keep("<"))


@intrinsic
def spread(typing_context: Any, value: Any) -> Any:
    """A number in every lane."""

    def build(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        inserted = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), args[0], ir.Constant(ir.IntType(32), 0))
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
