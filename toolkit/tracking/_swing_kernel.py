"""The compiled inside of the swing: its equation of motion, integrated by the fourth-order rule of Runge and Kutta."""

from __future__ import annotations

import math
from typing import Any

from toolkit.motion.kernels.pointer import reals, skip

# The caller's places: the address of the motions, each its nine values, its times and room for its angles and their rates;
# then how many times and motions there are.
MOTIONS, TIMES, COUNT = range(3)


def swing(places: Any) -> None:
    """The angle and its rate of each motion at its times, integrated from each to the next."""
    times = places[TIMES]
    for k in range(places[COUNT]):
        values = skip(reals(places, MOTIONS), k * (9 + 3 * times))
        t = skip(values, 9)
        angles, rates = skip(t, times), skip(t, 2 * times)
        w2, gamma, beta, theta, rate = values[4], values[5], values[6], values[7], values[8]
        longest = 0.06 / math.sqrt(abs(w2) + 1e-12)
        now = 0.0
        for i in range(times):
            span = t[i] - now
            n = math.ceil(abs(span) / longest)
            h = span / n if n > 0 else 0.0
            for _ in range(n):
                a1 = -w2 * math.sin(theta) - (2.0 * gamma + beta * abs(rate)) * rate
                v2 = rate + 0.5 * h * a1
                a2 = -w2 * math.sin(theta + 0.5 * h * rate) - (2.0 * gamma + beta * abs(v2)) * v2
                v3 = rate + 0.5 * h * a2
                a3 = -w2 * math.sin(theta + 0.5 * h * v2) - (2.0 * gamma + beta * abs(v3)) * v3
                v4 = rate + h * a3
                a4 = -w2 * math.sin(theta + h * v3) - (2.0 * gamma + beta * abs(v4)) * v4
                theta += h / 6.0 * (rate + 2.0 * v2 + 2.0 * v3 + v4)
                rate += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)
            now = t[i]
            angles[i] = theta
            rates[i] = rate
