"""The stiff route: Rodas4, an L-stable linearly implicit method of order 4 with an exact 2 × 2 Jacobian.

For drag so strong that the velocity follows the angle at once (overdamped by 100 and more), where an explicit method
would have to resolve a decay that nobody sees. Numbers: Hairer & Wanner, Solving Ordinary Differential Equations II.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from toolkit.motion.pointer import call_terms

DONE, TOO_MANY_STEPS, NOT_FINITE = 0, 1, 2

# fmt: off
GAMMA = 0.25
A = np.array([
    [0.0, 0.0, 0.0, 0.0, 0.0],
    [1.544, 0.0, 0.0, 0.0, 0.0],
    [0.9466785280815826, 0.2557011698983284, 0.0, 0.0, 0.0],
    [3.314825187068521, 2.896124015972201, 0.9986419139977817, 0.0, 0.0],
    [1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950, 0.0],
    [1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950, 1.0],
])
C = np.array([
    [0.0, 0.0, 0.0, 0.0, 0.0],
    [-5.6688, 0.0, 0.0, 0.0, 0.0],
    [-2.430093356833875, -0.2063599157091915, 0.0, 0.0, 0.0],
    [-0.1073529058151375, -9.594562251023355, -20.47028614809616, 0.0, 0.0],
    [7.496443313967647, -10.24680431464352, -33.99990352819905, 11.70890893206160, 0.0],
    [8.083246795921522, -7.981132988064893, -31.52159432874371, 16.31930543123136, -6.058818238834054],
])
NODES = np.array([0.0, 0.386, 0.21, 0.63, 1.0, 1.0])
SLOPES = np.array([0.25, -0.1043, 0.1035, -0.03620000000000023, 0.0, 0.0])
H2 = np.array([10.12623508344586, -7.487995877610167, -34.80091861555747, -7.992771707568823, 1.025137723295662])
H3 = np.array([-0.6762803392801253, 6.087714651680015, 16.43084320892478, 24.76722511418386, -6.594389125716872])
# fmt: on


@njit(cache=True)
def _row(layout: Any, columns: Any, values: Any, B: Any, row: int) -> float:
    total = 0.0
    for e in range(layout[row], layout[row + 1]):
        total += values[e] * B[columns[e]]
    return total


@njit(cache=True)
def integrate(
    address: int, q: Any, n_basis: int, layout: Any, columns: Any, values: Any, theta: float, w: float, start: float,
    t: Any, tolerance: float, max_steps: int, out: Any,
) -> tuple[int, int, float]:  # fmt: skip
    """Fill `out` (2, n) at the scaled times t. Returns status, steps, estimated error of θ."""
    B, s = np.zeros(max(n_basis, 1)), np.zeros(4)
    U = np.zeros((6, 2))
    now, steps, i, count = start, 0, 0, t.size
    end, total = t[count - 1], 0.0
    h = 1e-3 * min(1.0, end - start)
    while i < count and t[i] <= start:
        out[0, i], out[1, i] = theta, w
        i += 1
    while i < count:
        if steps >= max_steps:
            return TOO_MANY_STEPS, steps, total
        steps += 1
        h = min(h, end - now)
        s[0], s[1], s[2], s[3] = now, theta, w, 1.0 if w > 0.0 else -1.0
        call_terms(address, q.ctypes.data, s.ctypes.data, B.ctypes.data)
        by_theta, by_w, by_t = (
            _row(layout, columns, values, B, 1),
            _row(layout, columns, values, B, 2),
            _row(layout, columns, values, B, 3),
        )
        g = 1.0 / (h * GAMMA)
        determinant = g * (g - by_w) - by_theta
        x = y = 0.0
        for stage in range(6):
            x, y = theta, w
            r0 = r1 = 0.0
            for j in range(stage):
                x += A[stage, j] * U[j, 0]
                y += A[stage, j] * U[j, 1]
                r0 += C[stage, j] * U[j, 0]
                r1 += C[stage, j] * U[j, 1]
            s[0], s[1], s[2], s[3] = now + NODES[stage] * h, x, y, 1.0 if y > 0.0 else -1.0
            call_terms(address, q.ctypes.data, s.ctypes.data, B.ctypes.data)
            r0 = y + r0 / h
            r1 = _row(layout, columns, values, B, 0) + r1 / h + SLOPES[stage] * h * by_t
            U[stage, 0] = ((g - by_w) * r0 + r1) / determinant
            U[stage, 1] = (by_theta * r0 + g * r1) / determinant
        error = max(abs(U[5, 0]), abs(U[5, 1]) / (1.0 + abs(by_w)))
        if not error < 1e300:
            h *= 0.1
            if h < 1e-14 * (1.0 + abs(now)):
                return NOT_FINITE, steps, total
            continue
        grow = min(6.0, max(0.2, 0.9 * (tolerance / error) ** 0.25)) if error > 0.0 else 6.0
        if error > tolerance and h > 1e-14 * (1.0 + abs(now)):
            h *= grow
            continue
        x, y = x + U[5, 0], y + U[5, 1]
        k20 = k21 = k30 = k31 = 0.0
        for j in range(5):
            k20 += H2[j] * U[j, 0]
            k21 += H2[j] * U[j, 1]
            k30 += H3[j] * U[j, 0]
            k31 += H3[j] * U[j, 1]
        while i < count and t[i] <= now + h:
            p = (t[i] - now) / h
            out[0, i] = theta * (1.0 - p) + p * (x + (1.0 - p) * (k20 + p * k30))
            out[1, i] = w * (1.0 - p) + p * (y + (1.0 - p) * (k21 + p * k31))
            i += 1
        now += h
        theta, w = x, y
        total += abs(U[5, 0])
        h *= grow
    return DONE, steps, total
