"""The Runge–Kutta route (DOP853 with its interpolant), for terms without a Taylor recurrence.

The state is θ, w and, by the variational equation, every sensitivity and the global error, to which each step adds its
own. Turning points are found to machine precision by shortening the step until w is zero at its end.
"""

from __future__ import annotations

import math
from typing import Any

from numba import njit

from toolkit.motion.kernels import dop853_table
from toolkit.motion.kernels.events import SLACK, SLIP, STICK, note
from toolkit.motion.kernels.friction import held_until, leave_rest
from toolkit.motion.kernels.pointer import call_slack, call_terms, skip, unpack
from toolkit.motion.routes import DONE, NOT_FINITE, ROW, TOO_MANY_STEPS

_WIDE, _E = dop853_table.A.shape[1], dop853_table.D.shape[1]
_C = dop853_table.A.size
_E3 = _C + dop853_table.NODES.size
_E5 = _E3 + dop853_table.E3.size
_D = _E5 + dop853_table.E5.size


@njit
def _slope(
    address: int, q: Any, layout: Any, columns: Any, values: Any, s: Any, B: Any, y: Any, m: int, out: Any
) -> None:
    """y' for y = (θ, w, δθ₁, δw₁, …, error_θ, error_w)."""
    s[1] = y[0]
    s[2] = y[1]
    call_terms(address, q, s, B)
    by_theta = by_w = 0.0
    for e in range(layout[1], layout[2]):
        by_theta += values[e] * B[columns[1 + e]]
    for e in range(layout[2], layout[3]):
        by_w += values[e] * B[columns[1 + e]]
    for d in range(0, m, 2):
        row = 3 + d // 2 if d > 0 else 0  # rows: F, F_θ, F_w, F_τ, sensitivities, and the error, which nothing forces
        v = by_theta * y[d] + by_w * y[d + 1] if d > 0 else 0.0
        for e in range(layout[row], layout[row + 1]):
            v += values[e] * B[columns[1 + e]]
        out[d] = y[d + 1]
        out[d + 1] = v


@njit
def _stages(
    address: int, q: Any, layout: Any, columns: Any, values: Any, s: Any, B: Any, m: int, t: float, h: float,
    y: Any, K: Any, first: int, last: int, table: Any, z: Any,
) -> None:  # fmt: skip
    for i in range(first, last):
        for d in range(m):
            v = 0.0
            for j in range(i):
                v += table[_WIDE * i + j] * K[m * j + d]
            z[d] = y[d] + h * v
        s[0] = t + table[_C + i] * h
        _slope(address, q, layout, columns, values, s, B, z, m, skip(K, m * i))


@njit
def _powers(start: float, P: Any, m: int, d: int, h: float, c: Any) -> None:
    """The interpolant of component d by powers of the time in the step."""
    for k in range(8):
        c[k] = 0.0
    for r in range(6, -1, -1):
        c[0] += P[r * m + d]
        for k in range(7, -1, -1):  # times p or 1 − p
            below = c[k - 1] if k > 0 else 0.0
            c[k] = below if r % 2 == 0 else c[k] - below
    c[0] += start
    for k in range(1, 8):
        c[k] /= h**k


def dop853(places: Any) -> None:
    """Fill `out` and `report`: see `routes`; `address` is that of the equation's terms."""
    sizes, q, layout, columns, values, numbers, t, out, report, work, table = unpack(places)
    address = sizes[10]
    switches = sizes[3]
    count = sizes[7]
    m = 4 + 2 * sizes[6]
    tolerance = numbers[4]
    per_second = numbers[5]
    s = work
    B = skip(s, 4)
    y = skip(B, sizes[0] + 1)
    z = skip(y, m)
    fresh = skip(z, m)
    K = skip(fresh, m)
    P = skip(K, 16 * m)
    series = skip(P, 7 * m)
    for d in range(m):
        y[d] = numbers[4 + d] if 1 < d < m - 2 else 0.0
    y[0] = numbers[1]
    y[1] = numbers[2]
    now = numbers[3]
    h = worst = 0.0
    found = steps = i = 0
    sign = 1.0 if y[1] > 0.0 else -1.0
    resting = switches != 0 and y[1] == 0.0
    end = t[count - 1]
    report[0] = DONE
    held = True  # for the samples at the start itself
    until = now
    falls = -1.0  # the step at whose end the string goes slack
    while report[0] == DONE:
        if held:
            while i < count and t[i] <= until:
                for d in range(m - 2):
                    out[d * count + i] = y[d] * (per_second if d % 2 else 1.0)
                i += 1
            held = False
        if i >= count:
            break
        s[0] = now
        if resting:
            resting = False
            s[1] = y[0]
            s[2] = 0.0
            held, sign, ratio = leave_rest(address, False, q, s, B, table, columns, values, sizes[4], sign)
            if steps > 0 or held:
                for d in range(3, m, 2):
                    y[d] *= ratio
            if held:
                until, way = end, 0.0
                if sizes[5] != 0:
                    until, way = held_until(address, False, q, s, B, table, columns, values, numbers[0], now, end)
                if way != 0.0:
                    sign = way
                found = note(report, found, STICK, now, y[0], 0.0)
                if way != 0.0:
                    found = note(report, found, SLIP, until, y[0], 0.0)
                now = until
                h = 0.0
                steps += 1
                continue
        s[3] = sign
        _slope(address, q, layout, columns, values, s, B, y, m, K)
        if h == 0.0:
            h = min(0.1, 0.5 * tolerance ** (1.0 / 8.0) / (1e-3 + abs(K[0]) + abs(K[1])) + 1e-6)
        error = grow = whole = low = high = 0.0
        turning = turned = False
        while True:  # until the step is short enough and, where w is zero inside it, ends there
            if steps >= sizes[9]:
                report[0] = TOO_MANY_STEPS
                break
            steps += 1
            h = min(h, end - now)
            _stages(address, q, layout, columns, values, s, B, m, now, h, y, K, 1, 13, table, z)
            if not turning:
                five = three = 0.0
                for d in range(2):
                    e5 = e3 = 0.0
                    for j in range(13):
                        e5 += table[_E5 + j] * K[m * j + d]
                        e3 += table[_E3 + j] * K[m * j + d]
                    five += e5 * e5
                    three += e3 * e3
                error = h * five / math.sqrt(five + 0.01 * three) if five > 0.0 else 0.0
                if not error < 1e300:
                    h *= 0.1
                    if h < 1e-14 * (1.0 + abs(now)):
                        report[0] = NOT_FINITE
                        break
                    continue
                grow = min(6.0, 0.9 * (tolerance / error) ** 0.125) if error > 0.0 else 6.0
                if error > tolerance and h > 1e-14 * (1.0 + abs(now)):
                    h *= max(0.2, grow)
                    continue
                if switches == 0 or sign * z[1] >= 0.0:
                    break
                turning = turned = True
                whole = high = h
                low = 0.0
            elif sign * z[1] < 0.0:
                high = h
            else:
                low = h
            near = h - z[1] / K[12 * m + 1] if K[12 * m + 1] != 0.0 else -1.0
            if not low < near < high:
                near = 0.5 * (low + high)
            if z[1] == 0.0 or abs(near - h) <= 2e-16 * (abs(now) + h):
                if y[1] == 0.0 and h < 1e-6 * whole:  # it leaves rest the other way
                    sign = s[3] = -sign
                    h = whole
                    turning = turned = False
                    s[0] = now
                    _slope(address, q, layout, columns, values, s, B, y, m, K)
                    continue
                break
            h = near
        if report[0] != DONE:
            break
        watched = sizes[12] != 0 and h != falls
        if t[i] <= now + h or watched:
            for d in range(m):  # z, the new point, was the twelfth stage
                change = z[d] - y[d]
                P[d] = change
                P[m + d] = h * K[d] - change
                P[2 * m + d] = 2.0 * change - h * (K[12 * m + d] + K[d])
            _stages(address, q, layout, columns, values, s, B, m, now, h, y, K, 13, 16, table, fresh)
            for r in range(4):
                for d in range(m):
                    v = 0.0
                    for stage in range(16):
                        v += table[_D + _E * r + stage] * K[m * stage + d]
                    P[(3 + r) * m + d] = h * v
            if watched:
                for d in range(2):
                    _powers(y[d], P, m, d, h, skip(series, d * ROW))
                room = skip(series, 2 * ROW)
                room[0] = now
                room[1] = h
                room[3] = sign
                call_slack(sizes[13], sizes[12], q, room, series, 7)
                falls = room[2]
                if 0.0 < falls < h:  # once more, to there
                    h = falls
                    continue
            while i < count and t[i] <= (now if falls == 0.0 else now + h):
                part = (t[i] - now) / h
                for d in range(m - 2):
                    v = 0.0
                    for r in range(6, -1, -1):
                        v = (v + P[r * m + d]) * (part if r % 2 == 0 else 1.0 - part)
                    out[d * count + i] = (y[d] + v) * (per_second if d % 2 else 1.0)
                i += 1
        if falls == 0.0:
            h = 0.0
        else:
            for d in range(m):
                y[d] = z[d]
        now += h
        y[m - 2] += math.copysign(0.8 * error, y[m - 2]) + 1.1e-16 * abs(y[0])
        y[m - 1] += math.copysign(0.8 * error, y[m - 1])
        worst = max(worst, abs(y[m - 2]))
        h *= max(grow, 0.2)
        if turned:
            y[1] = h = 0.0
            resting = True
        if falls >= 0.0:
            found = note(report, found, SLACK, now, y[0], y[1])
            if i < count:  # a sample less than a rounding error beyond
                out[i] = y[0]
                out[count + i] = y[1] * per_second
            break
    report[1] = steps
    report[2] = found
    report[3] = worst
