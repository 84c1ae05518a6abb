"""Sine and cosine for compiled loops: without a call or a branch, so that the compiler makes vector instructions of them."""

from __future__ import annotations

import math

from numba import njit

part = njit(
    forceinline=True, error_model="numpy", no_rewrites=True, no_cpython_wrapper=True, no_cfunc_wrapper=True,
    fastmath={"contract"},
)  # fmt: skip

# π as a sum of three numbers, the first two so short that their products with numbers of turns up to 2²⁸ are exact
_P1, _P2, _P3 = 3.141592502593994, 1.5099578831723193e-07, 1.0780605716316238e-14
_S1, _S2, _S3, _S4, _S5, _S6, _S7, _S8, _S9, _S10 = ((-1.0) ** k / math.factorial(2 * k + 1) for k in range(1, 11))
_WHOLE = 1.5 * 2.0**52  # added and taken away again, it leaves the nearest whole number


@part
def _sign(n: float) -> float:
    """1 where the whole number is even, else −1."""
    half = (0.5 * n - 0.25 + _WHOLE) - _WHOLE
    return 1.0 + 4.0 * half - 2.0 * n


@part
def _within(x: float, turns: float) -> float:
    """The sine of x − turns·π, which is off zero by π/2 at most, by its series."""
    r = ((x - turns * _P1) - turns * _P2) - turns * _P3
    r = r if abs(r) < 1.6 else 0.0  # of so large a number that it has no sine
    q = r * r
    q2 = q * q
    q4 = q2 * q2
    low = (_S1 + q * _S2) + q2 * (_S3 + q * _S4)
    high = (_S5 + q * _S6) + q2 * (_S7 + q * _S8)
    return r + r * q * (low + q4 * (high + q4 * (_S9 + q * _S10)))


@part
def sine(x: float) -> float:
    """Of an angle in radians, to 3e-16."""
    n = (x * (1.0 / math.pi) + _WHOLE) - _WHOLE
    return _sign(n) * _within(x, n)


@part
def cosine(x: float) -> float:
    """Of an angle in radians, to 3e-16."""
    n = (x * (1.0 / math.pi) - 0.5 + _WHOLE) - _WHOLE
    return -_sign(n) * _within(x, n + 0.5)
