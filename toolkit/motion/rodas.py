"""The stiff route: Rodas4, an L-stable linearly implicit method of order 4 with an exact 2 × 2 Jacobian.

For drag so strong that the velocity follows the angle at once (overdamped by 100 and more), where an explicit method
would have to resolve a decay that nobody sees. Numbers: Hairer & Wanner, Solving Ordinary Differential Equations II.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from toolkit.motion.pointer import call_terms, skip
from toolkit.motion.taylor import DONE, NOT_FINITE, TOO_MANY_STEPS

METHOD, STAGES = "Rodas4, L-stable", 7
FIRST, FLOOR = 0.03, 1e-15
MOST_STEPS = 200_000

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


TABLE = np.concatenate([a.ravel() for a in (A, C, NODES, SLOPES, H2, H3)])


def work_size(n_basis: int, sensitivities: int) -> int:
    """Numbers of working memory that `integrate` needs."""
    return 4 + 12 + n_basis + 1


@njit
def _row(layout: Any, columns: Any, values: Any, B: Any, row: int) -> float:
    total = 0.0
    for e in range(layout[row], layout[row + 1]):
        total += values[e] * B[columns[1 + e]]
    return total


def integrate(
    address: int, q: Any, sizes: Any, layout: Any, columns: Any, values: Any, numbers: Any, t: Any, out: Any, report: Any,
    work: Any, table: Any,
) -> None:  # fmt: skip
    """As `taylor.integrate`, without sensitivities and turning points; `address` of the terms, `table` Rodas4's numbers."""
    count = sizes[7]
    tolerance = numbers[4]
    s = work
    U = skip(s, 4)  # six stages of (θ, w)
    B = skip(U, 12)
    C_, NODES_, SLOPES_ = skip(table, 30), skip(table, 60), skip(table, 66)
    H2_, H3_ = skip(table, 72), skip(table, 77)
    theta = numbers[1]
    w = numbers[2]
    now = numbers[3]
    end = t[count - 1]
    total = 0.0
    steps = i = 0
    h = 1e-3 * min(1.0, end - now)
    report[0] = DONE
    while i < count and t[i] <= now:
        out[i] = theta
        out[count + i] = w
        i += 1
    while i < count:
        if steps >= sizes[9]:
            report[0] = TOO_MANY_STEPS
            break
        steps += 1
        h = min(h, end - now)
        s[0] = now
        s[1] = theta
        s[2] = w
        s[3] = 1.0 if w > 0.0 else -1.0
        call_terms(address, q, s, B)
        by_theta = _row(layout, columns, values, B, 1)
        by_w = _row(layout, columns, values, B, 2)
        by_t = _row(layout, columns, values, B, 3)
        g = 1.0 / (h * GAMMA)
        determinant = g * (g - by_w) - by_theta
        x = y = 0.0
        for stage in range(6):
            x = theta
            y = w
            r0 = r1 = 0.0
            for j in range(stage):
                a, c = table[5 * stage + j], C_[5 * stage + j]
                u, v = U[2 * j], U[2 * j + 1]
                x += a * u
                y += a * v
                r0 += c * u
                r1 += c * v
            s[0] = now + NODES_[stage] * h
            s[1] = x
            s[2] = y
            s[3] = 1.0 if y > 0.0 else -1.0
            call_terms(address, q, s, B)
            r0 = y + r0 / h
            r1 = _row(layout, columns, values, B, 0) + r1 / h + SLOPES_[stage] * h * by_t
            U[2 * stage] = ((g - by_w) * r0 + r1) / determinant
            U[2 * stage + 1] = (by_theta * r0 + g * r1) / determinant
        error = max(abs(U[10]), abs(U[11]) / (1.0 + abs(by_w)))
        if not error < 1e300:
            h *= 0.1
            if h < 1e-14 * (1.0 + abs(now)):
                report[0] = NOT_FINITE
                break
            continue
        grow = min(6.0, max(0.2, 0.9 * (tolerance / error) ** 0.25)) if error > 0.0 else 6.0
        if error > tolerance and h > 1e-14 * (1.0 + abs(now)):
            h *= grow
            continue
        x += U[10]
        y += U[11]
        k20 = k21 = k30 = k31 = 0.0
        for j in range(5):
            k20 += H2_[j] * U[2 * j]
            k21 += H2_[j] * U[2 * j + 1]
            k30 += H3_[j] * U[2 * j]
            k31 += H3_[j] * U[2 * j + 1]
        while i < count and t[i] <= now + h:
            p = (t[i] - now) / h
            out[i] = theta * (1.0 - p) + p * (x + (1.0 - p) * (k20 + p * k30))
            out[count + i] = w * (1.0 - p) + p * (y + (1.0 - p) * (k21 + p * k31))
            i += 1
        now += h
        theta = x
        w = y
        total += abs(U[10])
        h *= grow
    report[1] = steps
    report[2] = 0.0
    report[3] = total
