"""The compiled inside of the outline fit: the likeliest centre and radius, given how likely each ray finds each place."""

from __future__ import annotations

import math
from typing import Any

from toolkit.motion.kernels.pointer import reals, skip
from toolkit.trackers._disc_kernel import invert

# The caller's places: addresses of the rays' costs, of their directions' cosines and sines, of which count (0 or 1), of
# the numbers, of the result and of each ray's misfit; then how many rays there are and how many places were tried on each.
COST, COSINE, SINE, COUNTS, NUMBERS, RESULT, APART, RAYS, TRIED = range(9)
# numbers : the first place tried and the step to the next, what a ray may disagree by, the spread of the radius.
# result : x, y and radius, off the present ones; their variances.


def likeliest(places: Any) -> None:
    """The least robust (Cauchy's) sum of costs, by Newton's steps on each ray's costs joined by cubics (Catmull and Rom)."""
    cost, ux, uy, counts = reals(places, COST), reals(places, COSINE), reals(places, SINE), reals(places, COUNTS)
    numbers, result, apart = reals(places, NUMBERS), reals(places, RESULT), reals(places, APART)
    rays, tried = places[RAYS], places[TRIED]
    first, h, far = numbers[0], numbers[1], numbers[2]
    info = skip(numbers, 4)  # three rows of eight, then the slope and what `invert` needs
    right, spare = skip(info, 24), skip(info, 32)
    for k in range(6):
        result[k] = 0.0
    for _ in range(30):
        for k in range(32):
            info[k] = 0.0
        info[0] = info[9] = 1e-6
        info[18] = 1.0 / (numbers[3] * numbers[3])
        right[2] = info[18] * result[2]
        for i in range(rays):
            at = (ux[i] * result[0] + uy[i] * result[1] + result[2] - first) / h
            at = 0.0 if at < 0.0 else tried - 1.001 if at > tried - 1.001 else at
            k = int(at)
            k = 1 if k < 1 else tried - 3 if k > tried - 3 else k
            f = at - k
            near = skip(cost, i * tried + k - 1)
            p0, p1, p2, p3 = near[0], near[1], near[2], near[3]
            b, c = 2.0 * p0 - 5.0 * p1 + 4.0 * p2 - p3, 3.0 * (p1 - p2) + p3 - p0
            value = p1 + 0.5 * f * (p2 - p0 + f * (b + f * c))
            value = value if value > 0.0 else 0.0
            slope = (0.5 * (p2 - p0) + f * (b + 1.5 * f * c)) / h
            bend, least = (b + 3.0 * f * c) / (h * h), slope * slope / (2.0 * value + 1.0)
            bend = bend if bend > least else least
            weight = 0.5 * counts[i] / (1.0 + value / far)
            apart[i] = value if counts[i] > 0.0 else math.inf
            bend *= weight
            slope *= weight
            right[0] += slope * ux[i]
            right[1] += slope * uy[i]
            right[2] += slope
            info[0] += bend * ux[i] * ux[i]
            info[8] += bend * ux[i] * uy[i]
            info[9] += bend * uy[i] * uy[i]
            info[16] += bend * ux[i]
            info[17] += bend * uy[i]
            info[18] += bend
        if not invert(info, 3, spare):
            result[3] = math.nan
            return
        size = 0.0
        for a in range(3):
            spare[a] = -(info[8 * a] * right[0] + info[8 * a + 1] * right[1] + info[8 * a + 2] * right[2])
            size = abs(spare[a]) if abs(spare[a]) > size else size
            result[3 + a] = info[9 * a]
        for a in range(3):
            result[a] += spare[a] if size < 0.3 else 0.3 / size * spare[a]
        if size < 1e-3:
            return
