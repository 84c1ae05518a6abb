"""The compiled inside of the swing: its equation of motion, integrated by the fourth-order rule of Runge and Kutta.

Motions are integrated side by side, LANES at once: each step waits for the one before it, and in that time the processor
can do others'.
"""

from __future__ import annotations

import math
from typing import Any

from numba import njit

from toolkit.motion.kernels.pointer import reals, skip
from toolkit.tracking._sine import cosine, part, sine

# The caller's places: addresses of the motions, each its nine values, its times and room for its angles and their rates, and
# of room for the lanes; then how many times and motions there are.
MOTIONS, ROOM, TIMES, COUNT = range(4)
LANES = 8
_THETA, _RATE, _SINE, _COSINE, _W2, _GAMMA, _BETA, _NOW, _LONGEST, _STEP, _STEPS, _END = (k * LANES for k in range(12))
SPARE = _END
# steps of one motion, each a tenth of a radian or less: some 5000 swings, an hour's; what asks for more, a fit on its way to where no
# frames could tell it, is no number
_MOST = 300_000.0
_AFRESH = 8  # times after which sine and cosine are computed, not turned on


@part
def turned(s: float, c: float, by: float) -> tuple[float, float]:
    """Sine and cosine of an angle that is a little farther `by` than that of sine s and cosine c, to 1e-12 for a tenth; in half
    the time that a sine takes."""
    q = by * by
    up = (1.0 - q * (1.0 / 6.0)) + (q * q) * (1.0 / 120.0 - q * (1.0 / 5040.0))
    less = (0.5 - q * (1.0 / 24.0)) + (q * q) * (1.0 / 720.0)
    return (s + (c * by) * up) - (s * q) * less, (c - (s * by) * up) - (c * q) * less


@part
def pull(w2: float, gamma: float, beta: float, s: float, rate: float) -> float:
    """θ'', s being the sine of θ."""
    return -w2 * s - (2.0 * gamma + beta * abs(rate)) * rate


@njit(inline="always")  # before LLVM sees it: only so it makes vector instructions of the lanes
def advance(
    h: float, w2: float, gamma: float, beta: float, theta: float, rate: float, s: float, c: float
) -> tuple[float, float, float, float]:
    """The angle, its rate, and its sine and cosine a time h later."""
    a1 = pull(w2, gamma, beta, s, rate)
    v2 = rate + 0.5 * h * a1
    a2 = pull(w2, gamma, beta, turned(s, c, 0.5 * h * rate)[0], v2)
    v3 = rate + 0.5 * h * a2
    a3 = pull(w2, gamma, beta, turned(s, c, 0.5 * h * v2)[0], v3)
    v4 = rate + h * a3
    a4 = pull(w2, gamma, beta, turned(s, c, h * v3)[0], v4)
    sixth = h / 6.0
    by = sixth * (rate + 2.0 * v2 + 2.0 * v3 + v4)
    s, c = turned(s, c, by)
    return theta + by, rate + sixth * (a1 + 2.0 * a2 + 2.0 * a3 + a4), s, c


def swing(places: Any) -> None:
    """The angle and its rate of each motion at its times, integrated from each to the next."""
    times, count, lanes = places[TIMES], places[COUNT], reals(places, ROOM)
    size = 9 + 3 * times
    theta, rate, w2 = lanes, skip(lanes, _RATE), skip(lanes, _W2)
    sines, cosines = skip(lanes, _SINE), skip(lanes, _COSINE)
    gamma, beta, now = skip(lanes, _GAMMA), skip(lanes, _BETA), skip(lanes, _NOW)
    longest, step, steps = skip(lanes, _LONGEST), skip(lanes, _STEP), skip(lanes, _STEPS)
    for first in range(0, count, LANES):
        used = count - first if count - first < LANES else LANES
        motions = skip(reals(places, MOTIONS), first * size)
        for k in range(_END):
            lanes[k] = 0.0
        for k in range(used):
            values = skip(motions, k * size)
            w2[k], gamma[k], beta[k], theta[k], rate[k] = values[4], values[5], values[6], values[7], values[8]
            fast = 0.33 * abs(values[8])  # a step turns it by no more than `turned` can
            slow = math.sqrt(abs(values[4]) + 1e-12)
            longest[k] = 0.1 / (fast if fast > slow else slow)
            way, last = 0.0, 0.0
            for i in range(times):
                way += abs(values[9 + i] - last)
                last = values[9 + i]
            if not way <= _MOST * longest[k]:
                theta[k], rate[k], longest[k] = math.nan, math.nan, math.inf
        for i in range(times):
            most = 0
            for k in range(used):
                t = motions[k * size + 9 + i]
                n = math.ceil(abs(t - now[k]) / longest[k])
                step[k] = (t - now[k]) / n if n > 0 else 0.0
                steps[k] = n
                now[k] = t
                most = n if n > most else most
                if i % _AFRESH == 0:
                    sines[k], cosines[k] = sine(theta[k]), cosine(theta[k])
            if used == 1:
                a, v, s, c = theta[0], rate[0], sines[0], cosines[0]
                for _ in range(most):
                    a, v, s, c = advance(step[0], w2[0], gamma[0], beta[0], a, v, s, c)
                theta[0], rate[0], sines[0], cosines[0] = a, v, s, c
            else:
                for j in range(most):
                    for k in range(LANES):
                        h = step[k] if j < steps[k] else 0.0
                        theta[k], rate[k], sines[k], cosines[k] = advance(
                            h, w2[k], gamma[k], beta[k], theta[k], rate[k], sines[k], cosines[k]
                        )
            for k in range(used):
                out = skip(motions, k * size + 9 + times + i)
                out[0] = theta[k]
                out[times] = rate[k]
