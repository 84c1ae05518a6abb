"""The Taylor route: series of 10 to 30 terms by generated recurrences, one integrator for every equation.

Each step expands θ and w = dθ/dτ about the present time, takes the longest step that the last terms allow, reads all
samples inside it off the polynomial, and carries along, by the linear variational equation, the sensitivities asked
for and the global error (each step adds its own). Where the equation depends on the sign of w, the turning point is
found to machine precision and the series starts again there; friction that can hold the pendulum holds it.
Time and state are summed with compensation, so these functions must not be compiled with fastmath.

The functions work on plain pointers: with NumPy arrays the first compilation takes three times as long.
"""

from __future__ import annotations

import math
from typing import Any

from numba import njit

from toolkit.motion.kernels.events import SLACK, SLIP, STICK, note
from toolkit.motion.kernels.friction import held_until, leave_rest
from toolkit.motion.kernels.pointer import bits_of, call_jet, call_slack, float_of, skip, unpack
from toolkit.motion.kernels.sampling import sample_step
from toolkit.motion.kernels.vector import evaluate_8
from toolkit.motion.routes import DONE, NOT_FINITE, ROW, SPARE, TOO_MANY_STEPS

_FEW = 8  # terms of F_θ and F_w with which the error is carried along
_SAFETY = 15.0  # near the separatrix the plain estimate has been up to 13 times too small (benchmarks/integrators.py accuracy)


@njit(fastmath={"contract"})
def _value(c: Any, n: int, x: float) -> float:
    v = c[n]
    for k in range(n - 1, -1, -1):
        v = v * x + c[k]
    return v


@njit(fastmath={"contract"})
def _ahead(c: Any, n: int, h: float) -> tuple[float, float, float]:
    """(θ(h) − θ(0))/h, the same of w, and w'(h), all at once; w lies a row after θ."""
    w = skip(c, ROW)
    theta, slope, v = c[n], 0.0, w[n]
    for k in range(n - 1, 0, -1):
        theta = theta * h + c[k]
        slope = slope * h + v
        v = v * h + w[k]
    return theta, v, slope * h + v


@njit
def _power(x: float, n: int) -> float:
    result = 1.0
    while n > 0:
        if n & 1:
            result *= x
        x *= x
        n >>= 1
    return result


@njit
def _turning_point(c: Any, n: int, h: float, sign: float, x: Any) -> tuple[float, bool]:
    """The first time in (0, h] where sign·w falls below 0 (or −1), and whether w is against `sign` from the start.

    c : the row of θ, before that of w.    x : room for SPARE numbers.
    """
    w = skip(c, ROW)
    rest, power = 0.0, 1.0
    for k in range(2, n + 1):
        power *= h
        rest += abs(w[k]) * power
    if abs(w[0]) > (abs(w[1]) + rest) * h:
        return -1.0, False
    if w[0] == 0.0 and abs(w[1]) > rest:  # leaves rest and does not come back
        return -1.0, sign * w[1] < 0.0
    v = skip(x, 16)
    for i in range(8):
        x[i] = h * (i + 1) / 8.0
    evaluate_8(c, n, x, 0.0, 0.0, skip(x, 8), 8, 1.0)
    left, before = 0.0, w[0]
    for i in range(8):
        if sign * v[i] < 0.0:
            if left == 0.0 and before == 0.0:
                # leaving a turning point: the motion is against the sign, or turns again within this part
                left = x[i] * 1e-3
                before = _value(w, n, left)
                if sign * before < 0.0:
                    return -1.0, True
            return _root(w, n, left, x[i], before, v[i], sign), False
        left, before = x[i], v[i]
    return -1.0, False


@njit(fastmath={"contract"})
def _root(w: Any, n: int, left: float, right: float, at_left: float, at_right: float, sign: float) -> float:
    """The zero of w in a bracket, to the last digit: Halley's steps from the chord, halving where they leave the bracket."""
    x = left + (right - left) * at_left / (at_left - at_right)
    for _ in range(100):
        value, slope, bend = w[n], 0.0, 0.0
        for k in range(n - 1, -1, -1):
            bend = bend * x + slope
            slope = slope * x + value
            value = value * x + w[k]
        if sign * value < 0.0:
            right = x
        else:
            left = x
        by = slope * slope - value * bend
        near = x - value * slope / by if by != 0.0 else right
        if not left <= near <= right:
            near = 0.5 * (left + right)
        if abs(near - x) <= 1e-7 * right:  # what is left is of the order of the cube
            return near
        x = near
    return x


@njit
def _longest(W: Any, n: int, log_tolerance: float, R: Any) -> float:
    """The step that the last two terms allow, (tolerance/|last|)^(1/k), or up to 1 % less; negative where they are not finite.

    A float's bits, read as a whole number, are nearly its logarithm to the base 2, off by a parabola to within 0.01.
    """
    least = 1000.0
    for k in range(n - 1, n + 1):
        last = max(abs(W[k]), abs(W[ROW + k]))
        if not last < 1e300:
            return -1.0
        if last > 0.0:
            bits = bits_of(last)
            part = float_of(bits & 0x000FFFFFFFFFFFFF | 0x3FF0000000000000) - 1.0
            log = (bits * 2.0**-52 - 1023.0) + 0.345 * part * (1.0 - part)
            least = min(least, (log_tolerance - log) * R[k])
    part = least - math.floor(least)
    return float_of(int((least - 0.345 * part * (1.0 - part) + 1022.995) * 2.0**52))


@njit(fastmath={"contract"})
def _combine(W: Any, columns: Any, values: Any, first: int, last: int, n: int, out: Any) -> None:
    """A row of the coefficient matrix times the basis series."""
    for k in range(n):
        out[k] = 0.0
    for e in range(first, last):
        row = skip(W, (3 + columns[e]) * ROW)
        v = values[e]
        for k in range(n):
            out[k] += v * row[k]


@njit(fastmath={"contract", "reassoc", "nsz"})
def _variational(J: Any, by_theta: int, by_w: int, D: Any, F: Any, n: int, R: Any) -> None:
    """Series of one sensitivity: δθ' = δw, δw' = F_θ δθ + F_w δw + F_p. D: the rows of δθ and δw.

    by_theta, by_w : length of the series of F_θ and F_w: 0 absent, 1 constant, 2 full.
    """
    K, E = skip(J, ROW), skip(D, ROW)
    for k in range(n):
        v, u = F[k], 0.0
        if by_theta == 2:
            for j in range(k + 1):
                v += J[j] * D[k - j]
        elif by_theta == 1:
            v += J[0] * D[k]
        if by_w == 2:
            for j in range(k + 1):
                u += K[j] * E[k - j]
        elif by_w == 1:
            u = K[0] * E[k]
        D[k + 1] = E[k] * R[k + 1]
        E[k + 1] = (v + u) * R[k + 1]


@njit(fastmath={"contract"})
def _carry(J: Any, D: Any, n: int, R: Any) -> None:
    """The same of an error, which nothing forces, from the first terms of F_θ and F_w: it need not be known to many digits.

    The newest numbers enter last, so that nothing waits for them; the first loop's bounds are known and it is unrolled.
    """
    K, E = skip(J, ROW), skip(D, ROW)
    for k in range(_FEW):
        v = 0.0
        for j in range(k, -1, -1):
            v += J[j] * D[k - j]
            v += K[j] * E[k - j]
        D[k + 1] = E[k] * R[k + 1]
        E[k + 1] = v * R[k + 1]
    for k in range(_FEW, n):
        v = 0.0
        for j in range(_FEW - 1, -1, -1):
            v += J[j] * D[k - j]
            v += K[j] * E[k - j]
        D[k + 1] = E[k] * R[k + 1]
        E[k + 1] = v * R[k + 1]


@njit
def _expand_deviations(
    W: Any, layout: Any, columns: Any, values: Any, sizes: Any, n: int, h: float, J: Any, F: Any, D: Any, R: Any
) -> int:
    """Fill the series of all sensitivities and, after them, of the error; give the order of the error's.

    J : to be filled with F_θ and F_w; where they are constant, their further terms are zero.    F : room for a row.
    """
    size = 0.0  # of what carries the error through the step
    for e in range(layout[2], layout[3]):
        size += values[e] * W[(3 + columns[1 + e]) * ROW]
    rough = min(max(5 + int(3.0 * min(h * max(1.0, abs(size)), 8.0)), _FEW), n)
    k_sens, columns = sizes[6], skip(columns, 1)
    for a in range(2):
        _combine(W, columns, values, layout[1 + a], layout[2 + a], n if k_sens > 0 else _FEW, skip(J, a * ROW))
    for a in range(k_sens):
        _combine(W, columns, values, layout[4 + a], layout[5 + a], n, F)
        _variational(J, sizes[1], sizes[2], skip(D, 2 * a * ROW), F, n, R)
    _carry(J, skip(D, 2 * k_sens * ROW), rough, R)
    return rough


@njit
def _unavoidable(W: Any, layout: Any, columns: Any, values: Any, now: float) -> float:
    """What rounding the coefficients and the drive's phase ω τ makes F wrong by, with the same sign at every step."""
    size = 0.0
    for e in range(layout[0], layout[1]):
        size += abs(values[e] * W[(3 + columns[1 + e]) * ROW])
    for e in range(layout[3], layout[4]):
        size += abs(values[e] * W[(3 + columns[1 + e]) * ROW] * now)
    return 1.1e-16 * size


def taylor(places: Any) -> None:
    """Fill `out` and `report`: see `routes`; `address` is that of the equation's jet."""
    sizes, q, layout, columns, values, numbers, t, out, report, work, R = unpack(places)
    address = sizes[10]
    switches = sizes[3]
    holds = sizes[4]
    timed = sizes[5]
    k_sens = sizes[6]
    count = sizes[7]
    n = sizes[8]
    log_tolerance = math.log(numbers[4]) / math.log(2.0)
    per_second = numbers[5]
    s = work  # the present time, θ, w and its sign
    lost = skip(work, 4)  # what the last sums of θ and w lost; the first is the fifth number of s
    x = skip(lost, 2)
    F = skip(x, SPARE)
    J = skip(F, ROW)
    D = skip(J, 2 * ROW)  # rows: δθ, δw of each sensitivity, then error of θ, of w
    error = skip(D, 2 * k_sens * ROW)
    W = skip(error, 2 * ROW)
    for a in range(2 * k_sens):
        D[a * ROW] = numbers[6 + a]
    error[0] = error[ROW] = lost[0] = lost[1] = 0.0
    s[1] = numbers[1]
    s[2] = numbers[2]
    hi = numbers[3]
    lo = worst = passed = slope = counted = 0.0
    steps = i = found = 0
    seed = 1
    sign = 1.0 if s[2] > 0.0 else -1.0
    resting = switches != 0 and s[2] == 0.0
    end = t[count - 1]
    report[0] = DONE
    held = True  # for the samples at the start itself
    until = hi
    while True:
        if held:
            while i < count and t[i] <= until:
                for a in range(2 + 2 * k_sens):
                    out[a * count + i] = (s[1 + a] if a < 2 else D[(a - 2) * ROW]) * (per_second if a % 2 else 1.0)
                i += 1
            held = False
        if i >= count:
            break
        if steps >= sizes[9]:
            report[0] = TOO_MANY_STEPS
            break
        s[0] = hi + lo
        if resting:
            resting = False
            held, sign, ratio = leave_rest(address, True, q, s, W, R, columns, values, holds, sign)
            if steps > 0 or held:  # δw jumps by the ratio of the accelerations, which is 0 where it sticks
                for a in range(k_sens + 1):
                    D[(2 * a + 1) * ROW] *= ratio
            if held:
                until, way = end, 0.0
                if timed != 0:
                    until, way = held_until(address, True, q, s, W, R, columns, values, numbers[0], hi + lo, end)
                if way != 0.0:
                    sign = way
                found = note(report, found, STICK, hi + lo, s[1], 0.0)
                if way != 0.0:
                    found = note(report, found, SLIP, until, s[1], 0.0)
                hi = until
                lo = 0.0
                steps += 1
                continue
        s[3] = sign
        call_jet(address, q, s, W, R, n)
        steps += 1
        if passed > 0.0:  # what the last step's series lacked at its end
            missing = _SAFETY * passed * abs(W[2 * ROW] - slope) / (n + 1) - counted
            if missing > 0.0:
                error[0] += math.copysign(passed * missing / (n + 2), error[0])
                error[ROW] += math.copysign(missing, error[ROW])
                worst = max(worst, abs(error[0]))
        h = end - hi - lo
        h = min(h, _longest(W, n, log_tolerance, R))
        if not h > 0.0:
            report[0] = NOT_FINITE
            break
        turned = False
        if switches != 0:
            root, against = _turning_point(W, n, h, sign, x)
            if against:
                sign = s[3] = -sign
                call_jet(address, q, s, W, R, n)
                root, against = _turning_point(W, n, h, sign, x)
            if root >= 0.0:
                h = root
                turned = True
        fell = -1.0
        if sizes[12] != 0:
            x[0] = hi + lo
            x[1] = h
            x[3] = sign
            call_slack(sizes[13], sizes[12], q, x, W, n)
            fell = x[2]
            if fell >= 0.0:
                h = fell
                turned = False
        if k_sens > 0:
            call_jet(sizes[11], q, s, W, R, n)
        rough = _expand_deviations(W, layout, columns, values, sizes, n, h, J, F, D, R)
        i = sample_step(t, i, count, hi, lo, h, W, D, k_sens, n, out, per_second, x)
        # the next state, with what the last sums lost
        change = h + lo
        new = hi + change
        lo = change - (new - hi)
        hi = new
        for a in range(2 * k_sens + 2):
            D[a * ROW] = _value(skip(D, a * ROW), n if a < 2 * k_sens else rough, h)
        power = 0.3 * _SAFETY * _power(h, n - 1)
        change_theta, change_w, slope = _ahead(W, n, h)
        seed = (seed * 1103515245 + 12345) % 2147483648
        rounding = (
            2.2e-16 if seed < 1073741824 else -2.2e-16
        )  # rounding errors add like a random walk, but not all of them
        error[ROW] += math.copysign(h * _unavoidable(W, layout, columns, values, s[0]), error[ROW])
        for a in range(2):
            series = skip(W, a * ROW)
            change = h * (change_theta if a == 0 else change_w) + lost[a]
            new = series[0] + change
            lost[a] = change - (new - series[0])
            s[1 + a] = new
            counted = power * max(h * abs(series[n]), 0.5 * abs(series[n - 1]))
            error[a * ROW] += math.copysign(counted, error[a * ROW]) + rounding * abs(new)
        worst = max(worst, abs(error[0]))
        passed = 0.0 if turned else h
        if turned:
            s[2] = lost[1] = 0.0
            resting = True
        if fell >= 0.0:
            found = note(report, found, SLACK, hi + lo, s[1], s[2])
            if i < count:  # a sample less than a rounding error beyond
                out[i] = s[1]
                out[count + i] = s[2] * per_second
            break
    if passed > 0.0 and report[0] == DONE:
        s[0] = hi + lo
        s[3] = sign
        call_jet(address, q, s, W, R, 1)
        missing = _SAFETY * passed * abs(W[2 * ROW] - slope) / (n + 1) - counted
        worst = max(worst, abs(error[0]) + passed * max(missing, 0.0) / (n + 2))
    report[1] = steps
    report[2] = found
    report[3] = worst
