"""The samples that lie inside a step, read off the step's series."""

from __future__ import annotations

import math
from typing import Any

from numba import njit

from toolkit.motion.kernels.pointer import skip
from toolkit.motion.kernels.vector import (
    LOCAL,
    LOCAL_TERMS,
    WIDTH,
    evaluate_8,
    evaluate_32,
    evaluate_local_32,
    recentre,
)
from toolkit.motion.routes import ROW

_DENSE = 96  # samples in a step from which on short series about many places are quicker


@njit
def sample_step(
    t: Any, i: int, count: int, hi: float, lo: float, h: float, first: Any, others: Any, pairs: int, n: int,
    out: Any, factor: float, spare: Any, tolerance: float,
) -> int:  # fmt: skip
    """Fill `out` from sample i on for the times up to hi + lo + h, and give the first sample beyond.

    first : the series of θ, and a row on that of θ'; others : `pairs` more such pairs. n : their order. spare : room for
    SPARE numbers. tolerance : what θ and θ' may be wrong by, between one digit and the next, where samples are dense.
    Samples beyond the step may be written too, in the last vector: a later step overwrites them.
    """
    stop = i
    while stop + 16 <= count and (t[stop + 15] - hi) - lo <= h:
        stop += 16
    while stop < count and (t[stop] - hi) - lo <= h:
        stop += 1
    for a in range(pairs + 1):
        series = skip(others, 2 * (a - 1) * ROW) if a > 0 else first
        row = skip(out, 2 * a * count)
        j = i
        if a == 0 and stop - i >= _DENSE and n >= 2 * LOCAL_TERMS:
            # n terms come down to the tolerance at h: at about which share of it do a few?
            share = 0.6 * math.exp(math.log(tolerance) * (1.0 / LOCAL_TERMS - 1.0 / n))
            if 16.0 * (t[stop - 1] - t[i]) < share * h * (stop - 1 - i):
                j = _densely(t, i, stop, count, hi, lo, h, series, n, row, factor, spare, tolerance)
        while j < stop:
            if stop - j > 16 and j + 32 <= count:
                evaluate_32(series, n, skip(t, j), hi, lo, skip(row, j), count, factor)
                j += 32
            elif j + 8 <= count:
                evaluate_8(series, n, skip(t, j), hi, lo, skip(row, j), count, factor)
                j += 8
            else:  # no room for eight
                for m in range(stop - j):
                    spare[16 + m] = t[j + m]
                evaluate_8(series, n, skip(spare, 16), hi, lo, spare, 8, factor)
                for m in range(stop - j):
                    row[j + m] = spare[m]
                    row[count + j + m] = spare[8 + m]
                j = stop
    return stop


@njit
def _densely(
    t: Any, i: int, stop: int, count: int, hi: float, lo: float, h: float, series: Any, n: int, row: Any,
    factor: float, spare: Any, tolerance: float,
) -> int:  # fmt: skip
    """The same by series of few terms, each about the middle of 32 samples, as long as they hold the tolerance."""
    local = skip(spare, WIDTH)
    j = i
    while stop - j >= _DENSE and j + 32 <= count:
        half = 0.0
        for g in range(WIDTH):
            left = min(j + 32 * g, stop - 1)
            begin, end = (t[left] - hi) - lo, (t[min(left + 31, stop - 1)] - hi) - lo
            spare[g] = 0.5 * (begin + end)
            half = max(half, 0.5 * (end - begin))
        recentre(series, n, spare, local)
        largest, power = 0.0, 2.0 * half / h  # the terms left out go down by that, or little slower
        for m in range(LOCAL - WIDTH, LOCAL):
            largest = max(largest, max(abs(local[m]), abs(local[LOCAL + m])))
        for _ in range(LOCAL_TERMS - 1):
            power *= half
        if not largest * power <= tolerance:
            break
        for g in range(WIDTH):
            if j < stop and j + 32 <= count:
                middle = lo + spare[g]
                evaluate_local_32(skip(local, g), LOCAL_TERMS - 1, skip(t, j), hi, middle, skip(row, j), count, factor)
                j += 32
    return j
