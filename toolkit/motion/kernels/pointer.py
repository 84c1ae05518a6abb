"""Plain pointers in compiled code: no bounds, no shapes, no reference counts, and therefore quick to compile.

Also calls through an address, so that one compiled integrator serves every equation.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir  # type: ignore[import-untyped]
from numba import njit, types
from numba.core import cgutils
from numba.extending import intrinsic

REALS, WHOLES = types.CPointer(types.float64), types.CPointer(types.int64)
_PIXELS, _GREYS = types.CPointer(types.float32), types.CPointer(types.uint8)


def _at(kind: Any, places: Any) -> Any:
    def load(context: Any, builder: Any, _: Any, values: Any) -> Any:
        address = builder.load(builder.gep(values[0], [values[1]]))
        return builder.inttoptr(address, context.get_value_type(kind))

    return kind(places, types.int64), load


@intrinsic
def reals(typing: Any, places: Any, number: Any) -> Any:
    """The array of float64 whose address is the numbered one of `places`."""
    return _at(REALS, places)


@intrinsic
def wholes(typing: Any, places: Any, number: Any) -> Any:
    """The array of int64 whose address is the numbered one of `places`."""
    return _at(WHOLES, places)


@intrinsic
def pixels(typing: Any, places: Any, number: Any) -> Any:
    """The array of float32 whose address is the numbered one of `places`."""
    return _at(_PIXELS, places)


@intrinsic
def greys(typing: Any, places: Any, number: Any) -> Any:
    """The array of uint8 whose address is the numbered one of `places`."""
    return _at(_GREYS, places)


@intrinsic
def skip(typing: Any, pointer: Any, count: Any) -> Any:
    """The pointer `count` elements further on."""
    return pointer(pointer, types.int64), lambda context, builder, _, values: builder.gep(values[0], [values[1]])


@intrinsic
def bits_of(typing: Any, number: Any) -> Any:
    """The bits of a float64 as an int64."""
    return types.int64(types.float64), lambda context, builder, _, values: builder.bitcast(values[0], ir.IntType(64))


@intrinsic
def float_of(typing: Any, bits: Any) -> Any:
    """The float64 that has the bits of an int64."""
    return types.float64(types.int64), lambda context, builder, _, values: builder.bitcast(values[0], ir.DoubleType())


@njit
def unpack(places: Any) -> Any:
    """The eleven arrays of an integrator, in the order of `routes`."""
    return (
        wholes(places, 0), reals(places, 1), wholes(places, 2), wholes(places, 3), reals(places, 4), reals(places, 5),
        reals(places, 6), reals(places, 7), reals(places, 8), reals(places, 9), reals(places, 10),
    )  # fmt: skip


def _call(builder: Any, values: Any) -> Any:
    """Numba's functions take two addresses more: where the result goes, and an exception, of which there is none."""
    address, *rest = values
    nothing = ir.Constant(ir.IntType(8).as_pointer(), None)
    result = cgutils.alloca_once(builder, nothing.type)
    function = ir.FunctionType(ir.IntType(32), [result.type, nothing.type, *[v.type for v in rest]])
    builder.call(builder.inttoptr(address, function.as_pointer()), [result, nothing, *rest])
    return nothing


@intrinsic
def call_jet(typing: Any, address: Any, q: Any, s: Any, work: Any, reciprocals: Any, order: Any) -> Any:
    """Call jet(q, s, W, R, n) at `address`."""
    signature = types.void(types.int64, REALS, REALS, REALS, REALS, types.int64)
    return signature, lambda context, builder, _, values: _call(builder, values)


@intrinsic
def call_slack(typing: Any, address: Any, tension: Any, q: Any, s: Any, series: Any, order: Any) -> Any:
    """Call slack(tension, q, s, series, n) at `address`."""
    signature = types.void(types.int64, types.int64, REALS, REALS, REALS, types.int64)
    return signature, lambda context, builder, _, values: _call(builder, values)


@intrinsic
def call_terms(typing: Any, address: Any, q: Any, s: Any, out: Any) -> Any:
    """Call terms(q, s, out) at `address`."""
    signature = types.void(types.int64, REALS, REALS, REALS)
    return signature, lambda context, builder, _, values: _call(builder, values)


@intrinsic
def call_kernel(typing: Any, address: Any, places: Any) -> Any:
    """Call another kernel(places) at `address`."""
    return types.void(types.int64, WHOLES), lambda context, builder, _, values: _call(builder, values)
