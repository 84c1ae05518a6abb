"""The Runge–Kutta route (DOP853 with its interpolant), for terms without a Taylor recurrence.

The state is θ, w and, by the variational equation, every sensitivity and the global error, to which each step adds its
own. Turning points are found to machine precision by shortening the step until w is zero at its end.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from toolkit.motion.friction import held_until, leave_rest
from toolkit.motion.pointer import call_terms

DONE, TOO_MANY_STEPS, NOT_FINITE = 0, 1, 2
STICK, SLIP = 0, 1


@njit(cache=True)
def _slope(
    address: int, q: Any, layout: Any, columns: Any, values: Any, s: Any, B: Any, y: Any, k: int, out: Any
) -> None:
    """y' for y = (θ, w, δθ₁, δw₁, …, error_θ, error_w)."""
    s[1], s[2] = y[0], y[1]
    call_terms(address, q.ctypes.data, s.ctypes.data, B.ctypes.data)
    force = by_theta = by_w = 0.0
    for e in range(layout[0], layout[1]):
        force += values[e] * B[columns[e]]
    for e in range(layout[1], layout[2]):
        by_theta += values[e] * B[columns[e]]
    for e in range(layout[2], layout[3]):
        by_w += values[e] * B[columns[e]]
    out[0], out[1] = y[1], force
    for a in range(k + 1):
        v = by_theta * y[2 + 2 * a] + by_w * y[3 + 2 * a]
        if a < k:
            for e in range(layout[4 + a], layout[5 + a]):
                v += values[e] * B[columns[e]]
        out[2 + 2 * a], out[3 + 2 * a] = y[3 + 2 * a], v


@njit(cache=True)
def _stages(
    address: int, q: Any, layout: Any, columns: Any, values: Any, s: Any, B: Any, k: int, t: float, h: float,
    y: Any, K: Any, first: int, last: int, A: Any, C: Any, z: Any,
) -> None:  # fmt: skip
    for i in range(first, last):
        for d in range(y.size):
            v = 0.0
            for j in range(i):
                v += A[i, j] * K[j, d]
            z[d] = y[d] + h * v
        s[0] = t + C[i] * h
        _slope(address, q, layout, columns, values, s, B, z, k, K[i])


@njit(cache=True)
def integrate(
    address: int, q: Any, n_basis: int, layout: Any, columns: Any, values: Any, switches: bool, holds: bool, timed: bool,
    rate: float, theta: float, w: float, start: float, t: Any, tolerance: float, max_steps: int, sensitivity: Any,
    out: Any, events: Any, A: Any, C: Any, E3: Any, E5: Any, D: Any, R: Any,
) -> tuple[int, int, int, float]:  # fmt: skip
    """As `taylor.integrate`, with the tables of DOP853."""
    k, count = sensitivity.shape[0], t.size
    m = 4 + 2 * k
    y, z, last, fresh = np.zeros(m), np.zeros(m), np.zeros(m), np.zeros(m)
    K, P = np.zeros((16, m)), np.zeros((7, m))
    B, s = np.zeros(max(n_basis, 1)), np.zeros(4)
    row = (columns[layout[0] : layout[1]], values[layout[0] : layout[1]])
    y[0], y[1] = theta, w
    for a in range(k):
        y[2 + 2 * a], y[3 + 2 * a] = sensitivity[a, 0], sensitivity[a, 1]
    now, worst = start, 0.0
    n_events, steps, i = 0, 0, 0
    sign = 1.0 if w > 0.0 else -1.0
    resting = switches and w == 0.0
    begun = False
    end = t[count - 1] if count > 0 else start
    h = 0.0
    while i < count and t[i] <= start:
        _store(out, i, y, k)
        i += 1
    while i < count:
        if resting:
            s[0], s[1], s[2] = now, y[0], 0.0
            held, sign, ratio = leave_rest(address, False, q, s, B, R, row, holds, sign)
            if begun:
                for a in range(k + 1):
                    y[3 + 2 * a] *= ratio
            resting = False
            if held:
                if n_events < events.shape[0]:
                    events[n_events, 0], events[n_events, 1], events[n_events, 2] = STICK, now, y[0]
                    n_events += 1
                until, way = end, 0.0
                if timed:
                    until, way = held_until(address, False, q, s, B, R, row, rate, now, end)
                for a in range(k + 1):
                    y[3 + 2 * a] = 0.0
                while i < count and t[i] <= until:
                    _store(out, i, y, k)
                    i += 1
                now, h = until, 0.0
                if way != 0.0:
                    sign = way
                    if n_events < events.shape[0]:
                        events[n_events, 0], events[n_events, 1], events[n_events, 2] = SLIP, now, y[0]
                        n_events += 1
                continue
        s[0], s[3] = now, sign
        _slope(address, q, layout, columns, values, s, B, y, k, K[0])
        if h == 0.0:
            h = min(0.1, 0.5 * tolerance ** (1.0 / 8.0) / (1e-3 + abs(K[0, 0]) + abs(K[0, 1])) + 1e-6)
        turned = False
        while True:
            if steps >= max_steps:
                return TOO_MANY_STEPS, steps, n_events, worst
            steps += 1
            h = min(h, end - now)
            _stages(address, q, layout, columns, values, s, B, k, now, h, y, K, 1, 13, A, C, z)
            five = three = 0.0
            for d in range(2):
                e5 = e3 = 0.0
                for j in range(13):
                    e5 += E5[j] * K[j, d]
                    e3 += E3[j] * K[j, d]
                five += e5 * e5
                three += e3 * e3
            error = h * five / math.sqrt(five + 0.01 * three) if five > 0.0 else 0.0
            if not error < 1e300:
                h *= 0.1
                if h < 1e-14 * (1.0 + abs(now)):
                    return NOT_FINITE, steps, n_events, worst
                continue
            grow = min(6.0, 0.9 * (tolerance / error) ** 0.125) if error > 0.0 else 6.0
            if error > tolerance and h > 1e-14 * (1.0 + abs(now)):
                h *= max(0.2, grow)
                continue
            break
        if switches and sign * z[1] < 0.0:  # w is zero inside this step: shorten it until it is zero at its end
            low, high, whole = 0.0, h, h
            for _ in range(100):
                near = h - z[1] / K[12, 1] if K[12, 1] != 0.0 else -1.0
                near = near if low < near < high else 0.5 * (low + high)
                moved = abs(near - h)
                h = near
                _stages(address, q, layout, columns, values, s, B, k, now, h, y, K, 1, 13, A, C, z)
                if sign * z[1] < 0.0:
                    high = h
                else:
                    low = h
                if z[1] == 0.0 or moved <= 2e-16 * (abs(now) + h):
                    break
            turned = True
            if y[1] == 0.0 and h < 1e-6 * whole:  # it leaves rest the other way
                sign, h = -sign, whole
                continue
        for d in range(m):
            last[d] = z[d]  # stage 12 is the new point
        j = i
        while j < count and t[j] <= now + h:
            j += 1
        if j > i:
            _stages(address, q, layout, columns, values, s, B, k, now, h, y, K, 13, 16, A, C, fresh)
            for d in range(m):
                change = last[d] - y[d]
                P[0, d], P[1, d] = change, h * K[0, d] - change
                P[2, d] = 2.0 * change - h * (K[12, d] + K[0, d])
                for r in range(4):
                    v = 0.0
                    for stage in range(16):
                        v += D[r, stage] * K[stage, d]
                    P[3 + r, d] = h * v
            while i < j:
                x = (t[i] - now) / h
                for d in range(m - 2):
                    v = 0.0
                    for r in range(6, -1, -1):
                        v = (v + P[r, d]) * (x if r % 2 == 0 else 1.0 - x)
                    z[d] = y[d] + v
                _store(out, i, z, k)
                i += 1
        now += h
        begun = True
        for d in range(m):
            y[d] = last[d]
        y[m - 2] += math.copysign(0.8 * error, y[m - 2]) + 1.1e-16 * abs(y[0])
        y[m - 1] += math.copysign(0.8 * error, y[m - 1])
        worst = max(worst, abs(y[m - 2]))
        if turned:
            y[1] = 0.0
            resting = True
        h = 0.0 if turned else h * max(grow, 0.2)
    return DONE, steps, n_events, worst


@njit(cache=True)
def _store(out: Any, i: int, y: Any, k: int) -> None:
    out[0, i], out[1, i] = y[0], y[1]
    for a in range(k):
        out[2 + a, i], out[2 + k + a, i] = y[2 + 2 * a], y[3 + 2 * a]
