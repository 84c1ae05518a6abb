"""The samples that lie inside a step, read off the step's series."""

from __future__ import annotations

from typing import Any

from numba import njit

from toolkit.motion.kernels.pointer import skip
from toolkit.motion.kernels.vector import evaluate_8, evaluate_32
from toolkit.motion.routes import ROW


@njit
def sample_step(
    t: Any, i: int, count: int, hi: float, lo: float, h: float, first: Any, others: Any, pairs: int, n: int,
    out: Any, factor: float, spare: Any,
) -> int:  # fmt: skip
    """Fill `out` from sample i on for the times up to hi + lo + h, and give the first sample beyond.

    first : the series of θ, and a row on that of θ'; others : `pairs` more such pairs. n : their order. spare : room for
    SPARE numbers. Samples beyond the step may be written too, in the last vector: a later step overwrites them.
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
