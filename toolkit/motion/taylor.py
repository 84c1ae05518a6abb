"""The Taylor route: series of 10 to 30 terms by generated recurrences, one integrator for every equation.

Each step expands θ and w = dθ/dτ about the present time, takes the longest step that the last terms allow, reads all
samples inside it off the polynomial, and carries along, by the linear variational equation, the sensitivities asked
for and the global error (each step adds its own). Where the equation depends on the sign of w, the turning point is
found to machine precision and the series starts again there; friction that can hold the pendulum holds it.
Time and state are summed with compensation, so these functions must not be compiled with fastmath.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from toolkit.motion.friction import held_until, leave_rest
from toolkit.motion.generate import ROW
from toolkit.motion.pointer import call_jet

DONE, TOO_MANY_STEPS, NOT_FINITE = 0, 1, 2
STICK, SLIP = 0, 1
MAX_ORDER = ROW - 2
SAFETY = 2.5  # the plain estimate has been up to 2.7 times too small (benchmarks/integrators.py accuracy)
RECIPROCALS = np.array([0.0] + [1.0 / k for k in range(1, ROW + 1)])


@njit(cache=True, fastmath={"contract"})
def _polynomial(c: Any, at: int, n: int, x: float) -> float:
    v = c[at + n]
    for k in range(n - 1, -1, -1):
        v = v * x + c[at + k]
    return v


@njit(cache=True, fastmath={"contract"})
def _slope(c: Any, n: int, x: float) -> float:
    """The slope of w's polynomial."""
    v = n * c[ROW + n]
    for k in range(n - 1, 0, -1):
        v = v * x + k * c[ROW + k]
    return v


@njit(cache=True, fastmath={"contract"})
def _above_first(c: Any, at: int, n: int, x: float) -> float:
    """The polynomial without its constant term."""
    v = c[at + n]
    for k in range(n - 1, 0, -1):
        v = v * x + c[at + k]
    return v * x


@njit(cache=True, fastmath={"contract"})
def _sample(c: Any, at: int, n: int, x: Any, count: int, out: Any, first: int) -> None:
    """Values of one series at x[0] … x[count − 1] into out[first] …; the inner loop runs over samples, side by side."""
    for j in range(count):
        out[first + j] = c[at + n]
    for k in range(n - 1, -1, -1):
        a = c[at + k]
        for j in range(count):
            out[first + j] = out[first + j] * x[j] + a


@njit(cache=True)
def _turning_point(W: Any, n: int, h: float, sign: float) -> tuple[float, bool]:
    """The first x in (0, h] where sign·w(x) falls below 0 (or −1), and whether w is against `sign` from the start."""
    rest = 0.0
    power = 1.0
    for k in range(2, n + 1):
        power *= h
        rest += abs(W[ROW + k]) * power
    if abs(W[ROW]) > (abs(W[ROW + 1]) + rest) * h:
        return -1.0, False
    if W[ROW] == 0.0 and abs(W[ROW + 1]) > rest:  # leaves rest and does not come back
        return -1.0, sign * W[ROW + 1] < 0.0
    left = 0.0
    parts = 6
    for i in range(1, parts + 1):
        right = h * i / parts
        if sign * _polynomial(W, ROW, n, right) < 0.0:
            if left == 0.0 and W[ROW] == 0.0:
                # leaving a turning point: the motion is against the sign, or turns again within this part
                left = right * 1e-3
                if sign * _polynomial(W, ROW, n, left) < 0.0:
                    return -1.0, True
            return _root(W, n, left, right, sign), False
        left = right
    return -1.0, False


@njit(cache=True)
def _root(W: Any, n: int, left: float, right: float, sign: float) -> float:
    """The zero of w in a bracket, to the last digit: Newton's steps, halving where they leave the bracket."""
    x = 0.5 * (left + right)
    for _ in range(100):
        value, slope = W[ROW + n], 0.0
        for k in range(n - 1, -1, -1):
            slope = slope * x + value
            value = value * x + W[ROW + k]
        if sign * value < 0.0:
            right = x
        else:
            left = x
        near = x - value / slope if slope != 0.0 else right
        if not left < near < right:
            near = 0.5 * (left + right)
            if near <= left or near >= right:
                break
        if abs(near - x) <= 1e-16 * right:
            return near
        x = near
    return x


@njit(cache=True, fastmath={"contract"})
def _combine(W: Any, columns: Any, values: Any, first: int, last: int, n: int, out: Any, at: int) -> None:
    """A row of the coefficient matrix times the basis series."""
    for k in range(n):
        out[at + k] = 0.0
    for e in range(first, last):
        row = (3 + columns[e]) * ROW
        v = values[e]
        for k in range(n):
            out[at + k] += v * W[row + k]


@njit(cache=True, fastmath={"contract", "reassoc", "nsz"})
def _variational(J: Any, lengths: Any, D: Any, at: int, F: Any, f_at: int, forced: bool, n: int, R: Any) -> None:
    """Series of one sensitivity: δθ' = δw, δw' = F_θ δθ + F_w δw + F_p. Rows of D: δθ at `at`, δw one row on."""
    for k in range(n):
        v = u = 0.0
        if lengths[0] == 2:
            for j in range(k + 1):
                v += J[j] * D[at + k - j]
        elif lengths[0] == 1:
            v = J[0] * D[at + k]
        if lengths[1] == 2:
            for j in range(k + 1):
                u += J[ROW + j] * D[at + ROW + k - j]
        elif lengths[1] == 1:
            u = J[ROW] * D[at + ROW + k]
        v += u
        if forced:
            v += F[f_at + k]
        D[at + k + 1] = D[at + ROW + k] * R[k + 1]
        D[at + ROW + k + 1] = v * R[k + 1]


@njit(cache=True)
def integrate(
    address: int,
    q: Any,
    n_work: int,
    layout: Any,  # (rows + 1,) where each matrix row starts in columns/values; rows: F, F_θ, F_w, F_τ, sensitivities
    columns: Any,
    values: Any,
    lengths: Any,
    switches: bool,
    holds: bool,
    timed: bool,
    rate: float,
    theta: float,
    w: float,
    start: float,
    t: Any,
    order: int,
    tolerance: float,
    max_steps: int,
    sensitivity: Any,  # (k, 2) δθ, δw at the start
    out: Any,  # (2 + 2k, n): θ, w, δθ …, δw …
    events: Any,  # (m, 3): kind, τ, θ
    R: Any,
) -> tuple[int, int, int, float]:
    """Fill `out` at the scaled times t ≥ start. Returns status, steps, events found, largest global error of θ."""
    n, count, k_sens = order, t.size, sensitivity.shape[0]
    W = np.zeros(n_work * ROW)
    J = np.zeros(2 * ROW)
    D = np.zeros((2 * (k_sens + 1)) * ROW)
    F, x = np.zeros(ROW), np.zeros(256)
    s = np.zeros(4)
    hi, lo = start, 0.0
    theta_lo, w_lo = 0.0, 0.0
    error_theta, error_w, worst = 0.0, 0.0, 0.0
    n_events, steps, i = 0, 0, 0
    passed, slope, counted = 0.0, 0.0, 0.0
    sign = 1.0 if w > 0.0 else -1.0
    resting = switches and w == 0.0
    row = (columns[layout[0] : layout[1]], values[layout[0] : layout[1]])
    seed = 1
    for a in range(k_sens):
        D[2 * a * ROW] = sensitivity[a, 0]
        D[(2 * a + 1) * ROW] = sensitivity[a, 1]
    end = t[count - 1] if count > 0 else start
    while i < count and t[i] <= start:
        out[0, i] = theta
        out[1, i] = w
        for a in range(k_sens):
            out[2 + a, i] = D[2 * a * ROW]
            out[2 + k_sens + a, i] = D[(2 * a + 1) * ROW]
        i += 1
    while i < count:
        if steps >= max_steps:
            return TOO_MANY_STEPS, steps, n_events, worst
        s[0], s[1], s[2] = hi + lo, theta, w
        if resting:
            held, sign, ratio = leave_rest(address, True, q, s, W, R, row, holds, sign)
            if steps > 0:  # δw jumps by the ratio of the accelerations
                for a in range(k_sens):
                    D[(2 * a + 1) * ROW] *= ratio
                error_w *= ratio
            resting = False
            if held:
                if n_events < events.shape[0]:
                    events[n_events, 0], events[n_events, 1], events[n_events, 2] = STICK, hi + lo, theta
                    n_events += 1
                until, way = end, 0.0
                if timed:
                    until, way = held_until(address, True, q, s, W, R, row, rate, hi + lo, end)
                while i < count and t[i] <= until:
                    out[0, i] = theta
                    out[1, i] = 0.0
                    for a in range(k_sens):
                        out[2 + a, i] = D[2 * a * ROW]
                        out[2 + k_sens + a, i] = 0.0
                    i += 1
                for a in range(k_sens):
                    D[(2 * a + 1) * ROW] = 0.0
                error_w = 0.0
                hi, lo = until, 0.0
                steps += 1
                if way != 0.0:
                    sign = way
                    if n_events < events.shape[0]:
                        events[n_events, 0], events[n_events, 1], events[n_events, 2] = SLIP, until, theta
                        n_events += 1
                continue
        s[0], s[3] = hi + lo, sign
        call_jet(address, q.ctypes.data, s.ctypes.data, W.ctypes.data, R.ctypes.data, n)
        steps += 1
        if passed > 0.0:  # what the last step's series lacked at its end
            missing = max(SAFETY * passed * abs(W[2 * ROW] - slope) / (n + 1) - counted, 0.0)
            error_theta += math.copysign(passed * missing / (n + 2), error_theta)
            error_w += math.copysign(missing, error_w)
            worst = max(worst, abs(error_theta))
        last = max(abs(W[n]), abs(W[ROW + n]))
        previous = max(abs(W[n - 1]), abs(W[ROW + n - 1]))
        h = end - hi - lo
        if last > 0.0 or previous > 0.0:
            reach = math.log(tolerance / last) / n if last > 0.0 else 1e300
            if previous > 0.0:
                reach = min(reach, math.log(tolerance / previous) / (n - 1))
            h = min(h, math.exp(reach))
        if not (h > 0.0 and h < 1e300):
            return NOT_FINITE, steps, n_events, worst
        turned = False
        if switches:
            root, against = _turning_point(W, n, h, sign)
            if against:
                sign = -sign
                s[3] = sign
                call_jet(address, q.ctypes.data, s.ctypes.data, W.ctypes.data, R.ctypes.data, n)
                root, against = _turning_point(W, n, h, sign)
            if root >= 0.0:
                h, turned = root, True
        terms = n if k_sens > 0 else min(n, 8)
        _combine(W, columns, values, layout[1], layout[2], terms if lengths[0] == 2 else 1, J, 0)
        _combine(W, columns, values, layout[2], layout[3], terms if lengths[1] == 2 else 1, J, ROW)
        for a in range(k_sens):
            forced = layout[5 + a] > layout[4 + a]
            if forced:
                _combine(W, columns, values, layout[4 + a], layout[5 + a], n, F, 0)
            _variational(J, lengths, D, 2 * a * ROW, F, 0, forced, n, R)
        at = 2 * k_sens * ROW
        D[at], D[at + ROW] = error_theta, error_w
        rough = min(n, 8)  # terms: the error need not be known to many digits
        _variational(J, lengths, D, at, F, 0, False, rough, R)
        # samples inside this step
        j = i
        reach = hi + lo + h
        while j < count and (t[j] <= reach or (t[j] - hi) - lo <= h):
            j += 1
        if j > i:
            while i < j:
                some = min(j - i, x.size)
                for m in range(some):
                    x[m] = (t[i + m] - hi) - lo
                _sample(W, 0, n, x, some, out[0], i)
                _sample(W, ROW, n, x, some, out[1], i)
                for a in range(k_sens):
                    _sample(D, 2 * a * ROW, n, x, some, out[2 + a], i)
                    _sample(D, (2 * a + 1) * ROW, n, x, some, out[2 + k_sens + a], i)
                i += some
        # the next state, with what the last sums lost
        change = _above_first(W, 0, n, h) + theta_lo
        new = theta + change
        theta_lo = change - (new - theta)
        theta = new
        change = _above_first(W, ROW, n, h) + w_lo
        new = w + change
        w_lo = change - (new - w)
        w = new
        change = h + lo
        new = hi + change
        lo = change - (new - hi)
        hi = new
        for a in range(2 * k_sens):
            D[a * ROW] = _polynomial(D, a * ROW, n, h)
        error_theta = _polynomial(D, at, rough, h)
        error_w = _polynomial(D, at + ROW, rough, h)
        power = h ** (n - 1)
        seed = (seed * 1103515245 + 12345) % 2147483648
        noise = 1.0 if seed < 1073741824 else -1.0  # rounding errors add like a random walk
        local = 0.3 * SAFETY * power
        rounding = 2.2e-16 * noise
        counted = local * max(h * abs(W[n]), 0.5 * abs(W[n - 1]))
        error_theta += math.copysign(counted, error_theta) + rounding * abs(theta)
        counted = local * max(h * abs(W[ROW + n]), 0.5 * abs(W[ROW + n - 1]))
        error_w += math.copysign(counted, error_w) + rounding * abs(w)
        passed, slope = 0.0 if turned else h, _slope(W, n, h)
        worst = max(worst, abs(error_theta))
        if turned:
            w, w_lo, resting = 0.0, 0.0, True
    if passed > 0.0:
        s[0], s[1], s[2], s[3] = hi + lo, theta, w, sign
        call_jet(address, q.ctypes.data, s.ctypes.data, W.ctypes.data, R.ctypes.data, 1)
        missing = max(SAFETY * passed * abs(W[2 * ROW] - slope) / (n + 1) - counted, 0.0)
        worst = max(worst, abs(error_theta) + passed * missing / (n + 2))
    return DONE, steps, n_events, worst
