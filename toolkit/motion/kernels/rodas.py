"""The stiff route: Rodas4, an L-stable linearly implicit method of order 4 with an exact 2 × 2 Jacobian.

For drag so strong that the velocity follows the angle at once (overdamped by 100 and more), where an explicit method
would have to resolve a decay that nobody sees. Numbers: Hairer & Wanner, Solving Ordinary Differential Equations II.
"""

from __future__ import annotations

from typing import Any

from numba import njit

from toolkit.motion.kernels.pointer import call_terms, reals, skip, wholes
from toolkit.motion.kernels.rodas_table import GAMMA
from toolkit.motion.routes import DONE, NOT_FINITE, TOO_MANY_STEPS


@njit
def _row(layout: Any, columns: Any, values: Any, B: Any, row: int) -> float:
    total = 0.0
    for e in range(layout[row], layout[row + 1]):
        total += values[e] * B[columns[1 + e]]
    return total


def rodas(places: Any) -> None:
    """Fill `out` and `report`: see `routes`; no turning points; `address` is that of the equation's terms."""
    sizes = wholes(places, 0)
    q = reals(places, 1)
    layout = wholes(places, 2)
    columns = wholes(places, 3)
    values = reals(places, 4)
    numbers = reals(places, 5)
    t = reals(places, 6)
    out = reals(places, 7)
    report = reals(places, 8)
    work = reals(places, 9)
    table = reals(places, 10)
    address = sizes[10]
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
