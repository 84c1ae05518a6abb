"""Calls from compiled code through an address, so that one compiled integrator serves every equation."""

from __future__ import annotations

from typing import Any

from llvmlite import ir  # type: ignore[import-untyped]
from numba import types
from numba.extending import intrinsic

_REAL = ir.DoubleType()
_INTEGER = ir.IntType(64)


def _call(context: Any, builder: Any, values: Any, pointers: int) -> Any:
    address, *rest = values
    kinds = [_REAL.as_pointer()] * pointers + [_INTEGER] * (len(rest) - pointers)
    function = ir.FunctionType(ir.VoidType(), kinds)
    arguments = [builder.inttoptr(v, k) if i < pointers else v for i, (v, k) in enumerate(zip(rest, kinds))]
    builder.call(builder.inttoptr(address, function.as_pointer()), arguments)
    return context.get_dummy_value()


@intrinsic
def call_jet(typing: Any, address: Any, q: Any, s: Any, work: Any, reciprocals: Any, order: Any) -> Any:
    """Call jet(q, s, W, R, n) at `address`; the arrays are given as addresses."""
    signature = types.void(*[types.int64] * 6)
    return signature, lambda context, builder, _, values: _call(context, builder, values, 4)


@intrinsic
def call_terms(typing: Any, address: Any, q: Any, s: Any, out: Any) -> Any:
    """Call terms(q, s, out) at `address`; the arrays are given as addresses."""
    signature = types.void(*[types.int64] * 4)
    return signature, lambda context, builder, _, values: _call(context, builder, values, 3)
