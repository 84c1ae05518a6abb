"""The stiff route: Rodas4, an L-stable linearly implicit method of order 4 with an exact 2 × 2 Jacobian.

For drag so strong that the velocity follows the angle at once (overdamped by 100 and more), where an explicit method
would have to resolve a decay that nobody sees. Numbers: Hairer & Wanner, Solving Ordinary Differential Equations II.
"""

from __future__ import annotations

import math
from typing import Any

from numba import njit

from toolkit.motion.kernels.pointer import call_terms, skip, unpack
from toolkit.motion.kernels.rodas_table import GAMMA
from toolkit.motion.kernels.sampling import sample_step
from toolkit.motion.routes import DONE, NOT_FINITE, ROW, TOO_MANY_STEPS


@njit
def _row(layout: Any, columns: Any, values: Any, B: Any, row: int) -> float:
    total = 0.0
    for e in range(layout[row], layout[row + 1]):
        total += values[e] * B[columns[1 + e]]
    return total


def rodas(places: Any) -> None:
    """Fill `out` and `report`: see `routes`; no turning points; `address` is that of the equation's terms."""
    sizes, q, layout, columns, values, numbers, t, out, report, work, table = unpack(places)
    address = sizes[10]
    count = sizes[7]
    tolerance = numbers[4]
    s = work
    U = skip(s, 4)  # six stages of (θ, w)
    B = skip(U, 12)
    P = skip(B, sizes[0] + 1)  # the step's cubics
    V = skip(P, ROW)
    room = skip(V, ROW)
    C_, NODES_, SLOPES_ = skip(table, 30), skip(table, 60), skip(table, 66)
    H2_, H3_ = skip(table, 72), skip(table, 77)
    theta = numbers[1]
    w = numbers[2]
    now = numbers[3]
    end = t[count - 1]
    total = between = h = 0.0
    steps = i = 0
    report[0] = DONE
    while i < count and t[i] <= now:
        out[i] = theta
        out[count + i] = w * numbers[5]
        i += 1
    while i < count:
        s[0] = now
        s[1] = theta
        s[2] = w
        s[3] = 1.0 if w > 0.0 else -1.0
        call_terms(address, q, s, B)
        force = _row(layout, columns, values, B, 0)
        by_theta = _row(layout, columns, values, B, 1)
        by_w = _row(layout, columns, values, B, 2)
        by_t = _row(layout, columns, values, B, 3)
        if h == 0.0:
            slow = abs(by_theta) / (1e-3 + abs(by_w)) + (numbers[0] if sizes[5] != 0 else 0.0)
            h = 0.1 * math.sqrt(math.sqrt(tolerance)) / (1e-6 + slow)
            if abs(force) > 0.1 * tolerance * by_w * by_w:  # θ will move that much while the velocity settles
                h = min(h, 0.5 / (1.0 + abs(by_w)))
        error = x = y = 0.0
        while True:  # until the step is short enough
            if steps >= sizes[9]:
                report[0] = TOO_MANY_STEPS
                break
            steps += 1
            h = min(h, end - now)
            per_h = 1.0 / h
            g = per_h / GAMMA
            per_determinant = 1.0 / (g * (g - by_w) - by_theta)
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
                f = force
                if stage > 0:
                    s[0] = now + NODES_[stage] * h
                    s[1] = x
                    s[2] = y
                    s[3] = 1.0 if y > 0.0 else -1.0
                    call_terms(address, q, s, B)
                    f = _row(layout, columns, values, B, 0)
                r0 = y + r0 * per_h
                r1 = f + r1 * per_h + SLOPES_[stage] * h * by_t
                U[2 * stage] = ((g - by_w) * r0 + r1) * per_determinant
                U[2 * stage + 1] = (by_theta * r0 + g * r1) * per_determinant
            error = max(abs(U[10]), abs(U[11]) / (1.0 + abs(by_w)))
            short = h < 1e-14 * (1.0 + abs(now))
            if error < 1e300 and (error <= tolerance or short):
                break
            if short:
                report[0] = NOT_FINITE
                break
            h *= max(0.1, 0.9 * (tolerance / error) ** 0.25) if error < 1e300 else 0.1
        if report[0] != DONE:
            break
        x += U[10]
        y += U[11]
        k20 = k21 = k30 = k31 = 0.0
        for j in range(5):
            k20 += H2_[j] * U[2 * j]
            k21 += H2_[j] * U[2 * j + 1]
            k30 += H3_[j] * U[2 * j]
            k31 += H3_[j] * U[2 * j + 1]
        _cubic(P, theta, x, k20, k30, 1.0 / h)
        _cubic(V, w, y, k21, k31, 1.0 / h)
        i = sample_step(t, i, count, now, 0.0, h, P, P, 0, 3, out, numbers[5], room)
        # the embedded method, of order 3, errs by `lower`; the method itself by that times about h, for which the share
        # of the error in the change over the step stands; the interpolant, between the ends, by about `lower` once
        lower = abs(U[10])
        change = abs(x - theta)
        share = (lower / change) ** (1.0 / 3.0) if lower < 1e-3 * change else 0.1
        total += lower * 10.0 * share
        between = max(between, 3.0 * lower)
        now += h
        theta = x
        w = y
        h *= min(6.0, 0.9 * (tolerance / error) ** 0.25) if error > 0.0 else 6.0
    report[1] = steps
    report[2] = 0.0
    report[3] = total + between


@njit
def _cubic(c: Any, left: float, right: float, k2: float, k3: float, per_h: float) -> None:
    """The step's interpolant  left (1 − p) + p (right + (1 − p)(k₂ + p k₃)),  p = x/h, by powers of x."""
    c[0] = left
    c[1] = (right - left + k2) * per_h
    c[2] = (k3 - k2) * per_h * per_h
    c[3] = -k3 * per_h * per_h * per_h
