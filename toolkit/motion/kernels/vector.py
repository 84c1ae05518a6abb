"""Polynomials at many places in compiled code, eight numbers at a time.

In LLVM's own vectors; a processor with narrower registers takes two for one.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir  # type: ignore[import-untyped]
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from toolkit.motion.kernels.pointer import REALS
from toolkit.motion.routes import ROW

WIDTH = 8
_DOUBLE = ir.DoubleType()
_VECTOR = ir.VectorType(_DOUBLE, WIDTH)
_ZERO = ir.Constant(_VECTOR, [0.0] * WIDTH)


def _load(builder: Any, pointer: Any, offset: Any = None) -> Any:
    if offset is not None:
        pointer = builder.gep(pointer, [offset])
    return builder.load(builder.bitcast(pointer, _VECTOR.as_pointer()), align=8)


def _store(builder: Any, vector: Any, pointer: Any, offset: Any) -> None:
    place = builder.gep(pointer, [offset])
    builder.store(vector, builder.bitcast(place, _VECTOR.as_pointer()), align=8)


def _all(builder: Any, number: Any) -> Any:
    """The number in every lane."""
    one = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), number, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(
        one, ir.Constant(_VECTOR, ir.Undefined), ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH)
    )


def _multiply_add(builder: Any, a: Any, b: Any, c: Any) -> Any:
    return builder.call(_intrinsic(builder, "fmuladd", _VECTOR, [_VECTOR] * 3), [a, b, c])


def _intrinsic(builder: Any, name: str, result: Any, arguments: list[Any]) -> Any:
    kind = ir.FunctionType(result, arguments)
    return cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}.v{WIDTH}f64")


def _polynomials(groups: int) -> Any:
    """Two series that lie a row apart, at 4·groups times less start and lost: out[j], and factor times the second at out[stride + j]."""

    @intrinsic
    def evaluate(
        typing: Any, series: Any, degree: Any, times: Any, start: Any, lost: Any, out: Any, stride: Any, factor: Any
    ) -> Any:
        def emit(context: Any, builder: Any, _: Any, values: Any) -> Any:
            c, n, t, begin, little, to, apart, by = values
            whole = n.type
            offsets = [ir.Constant(whole, WIDTH * g) for g in range(groups)]
            begin, little, by = (_all(builder, v) for v in (begin, little, by))
            xs = [builder.fsub(builder.fsub(_load(builder, t, o), begin), little) for o in offsets]
            rows = [c, builder.gep(c, [ir.Constant(whole, ROW)])]
            totals = []
            for row in rows:
                top = _all(builder, builder.load(builder.gep(row, [n])))
                totals.append([cgutils.alloca_once_value(builder, top) for _ in offsets])
            with cgutils.for_range(builder, n) as loop:
                at = builder.sub(builder.sub(n, ir.Constant(whole, 1)), loop.index)
                for row, sums in zip(rows, totals):
                    coefficient = _all(builder, builder.load(builder.gep(row, [at])))
                    for total, x in zip(sums, xs):
                        builder.store(_multiply_add(builder, builder.load(total), x, coefficient), total)
            for offset, first, second in zip(offsets, *totals):
                _store(builder, builder.load(first), to, offset)
                _store(builder, builder.fmul(builder.load(second), by), to, builder.add(offset, apart))
            return context.get_dummy_value()

        number, whole = types.float64, types.int64
        return types.void(REALS, whole, REALS, number, number, REALS, whole, number), emit

    return evaluate


evaluate_8, evaluate_32 = _polynomials(1), _polynomials(4)
