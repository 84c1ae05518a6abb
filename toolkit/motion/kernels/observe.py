"""Tension and energy of the pendulum along a motion, two nanoseconds a sample."""

from __future__ import annotations

from typing import Any

from numba import njit

from toolkit.motion.kernels.pointer import reals

_PI_HIGH, _PI_LOW = 3.141592653589793, 1.2246467991473532e-16
_ROUNDER = 6755399441055744.0  # 1.5·2⁵²: adding it leaves no digits after the point


@njit(fastmath={"contract"})
def _observe(n: int, p: Any, theta: Any, omega: Any, tension: Any, energy: Any) -> None:
    swing, weight, lift, half = p[1], p[2], p[3], p[4]
    for i in range(n):
        y = 0.5 * theta[i]
        turns = (y * (1.0 / _PI_HIGH) + _ROUNDER) - _ROUNDER
        y = (y - turns * _PI_HIGH) - turns * _PI_LOW
        z = y * y
        # sin y by its Taylor series: |y| ≤ π/2, so the first term left out is below 2e-18
        s = 1.0 / 51090942171709440000.0
        s = s * z - 1.0 / 121645100408832000.0
        s = s * z + 1.0 / 355687428096000.0
        s = s * z - 1.0 / 1307674368000.0
        s = s * z + 1.0 / 6227020800.0
        s = s * z - 1.0 / 39916800.0
        s = s * z + 1.0 / 362880.0
        s = s * z - 1.0 / 5040.0
        s = s * z + 1.0 / 120.0
        s = s * z - 1.0 / 6.0
        s = y + y * z * s
        rise = 2.0 * s * s
        square = omega[i] * omega[i]
        tension[i] = swing * square + weight * (1.0 - rise)
        energy[i] = lift * rise + half * square


def observe(places: Any) -> None:
    """places: (count, mℓ, mg, mgℓ, I/2); θ, ω; tension and energy, to be filled."""
    p = reals(places, 0)
    _observe(int(p[0]), p, reals(places, 1), reals(places, 2), reals(places, 3), reals(places, 4))
