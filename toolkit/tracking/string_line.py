"""The string as a straight line: its direction in one frame, to a few thousandths of a degree.

The direction that stands out most among those some 15 degrees to either side of the pivot's (which may not be known
well yet) is refined by least squares: a ridge of Gaussian profile, each cross-section on its own level (the mean of its
ends), first on the piece near the bob, then on the whole length.
"""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np


class StringLine(NamedTuple):
    """A point on the string (px), the direction pivot → bob (rad from the downward image axis, positive to the
    right), the standard uncertainties of the direction and of the line's place at the point, and the ridge's height
    over its own uncertainty."""

    x_px: float
    y_px: float
    angle_rad: float
    sigma_angle_rad: float
    sigma_px: float
    strength: float


def measure_string(
    luma: np.ndarray, bob: tuple[float, float], pivot: tuple[float, float], radius_px: float
) -> StringLine | None:
    """The string in one frame from where bob and pivot are thought to be; None where no string is seen."""
    out = np.zeros(6)
    if not _compiled()(luma, bob[0], bob[1], pivot[0], pivot[1], radius_px, out):
        return None
    line = StringLine(*(float(v) for v in out))
    return line if line.strength > 8 and np.all(np.isfinite(out)) else None


def seen_half(distance_px: np.ndarray, radius_px: float) -> np.ndarray:
    """Half the length of the piece of string that was measured, from how far the line's point is from the bob's centre."""
    return np.asarray(distance_px - _start(radius_px))


def _start(radius_px: float) -> float:
    """How far from the bob's centre the string is looked at first."""
    return 1.15 * radius_px + 6.0


@cache
def _compiled() -> Any:
    import numba

    @numba.njit(cache=True, nogil=True, error_model="numpy")
    def ridge(luma, bx, by, px, py, radius, out):
        rows, columns = luma.shape
        ux, uy = px - bx, py - by
        length = np.sqrt(ux * ux + uy * uy)
        if length < 2.0 * radius + 20.0:
            return False
        ux, uy = ux / length, uy / length
        start = radius + 6.0 + 0.15 * radius
        a = b = 0.0  # the line: across = a + b (along − middle)
        width2 = 1.5 * 1.5
        height = 0.0
        ridge_of, rest_of = np.empty(11), np.empty((100, 11))  # the ridge; each section less its own level and tilt
        for j in range(11):
            ridge_of[j] = np.exp(-((j - 5.0) ** 2) / (2 * width2))
        profile = np.empty(17)
        # strips across, and how much darker or brighter than both its sides the line at each slope from the bob is
        strips = np.empty((24, 65))
        far = min(start + 60.0, length - 4.0)
        for k in range(24):
            along = start + (k + 0.5) * (far - start) / 24
            for j in range(65):
                x, y = bx + ux * along - uy * (j - 32.0), by + uy * along + ux * (j - 32.0)
                ix, iy = int(x), int(y)
                strips[k, j] = np.nan
                if x >= 0.0 and y >= 0.0 and ix < columns - 1 and iy < rows - 1:
                    fx, fy = x - ix, y - iy
                    top = luma[iy, ix] * (1 - fx) + luma[iy, ix + 1] * fx
                    bottom = luma[iy + 1, ix] * (1 - fx) + luma[iy + 1, ix + 1] * fx
                    strips[k, j] = top * (1 - fy) + bottom * fy
        plain, best, slope_of = 0.0, 0.0, 0.0
        for i in range(-26, 27):
            sum1 = sum2 = 0.0
            seen = 0
            for k in range(24):
                j = int(np.round(i * (start + (k + 0.5) * (far - start) / 24) / far)) + 32
                g = strips[k, j] - 0.5 * (strips[k, j - 5] + strips[k, j + 5])
                if not np.isnan(g):
                    sum1 += g
                    sum2 += g * g
                    seen += 1
            if seen >= 12:
                clear = abs(sum1) / np.sqrt(seen * (sum2 - sum1 * sum1 / seen) + 4.0 * seen * seen)
                if abs(i) <= 4:
                    plain = max(plain, clear)
                if clear > best:
                    best, slope_of = clear, i / far
        first = slope_of if best > 1.5 * plain else 0.0
        for stage in range(3):
            end = length - 4.0
            if stage == 0:
                end = min(end, start + 60.0)
            elif stage == 1:
                end = min(end, start + 200.0)
            middle = 0.5 * (start + end)
            if end - start < 15.0:
                return False
            # a was the place at the former middle: carry it along
            if stage == 0:
                b = first
                out[5] = 0.0
            a0 = a + b * (middle - out[5])
            out[5] = middle
            a = a0
            sections = int(min(100.0, end - start))
            for _ in range(3):
                n00 = n01 = n11 = r0 = r1 = 0.0
                # the height of the ridge is fitted with the line held, then the line with the height held
                hh = hp = 0.0
                squares = 0.0
                count = 0
                used = 0
                for k in range(sections):
                    along = start + (k + 0.5) * (end - start) / sections
                    across = a + b * (along - middle)
                    qx, qy = bx + ux * along - uy * (across - 8.0), by + uy * along + ux * (across - 8.0)
                    rest_of[k, 0] = np.nan
                    ex, ey = qx - 16.0 * uy, qy + 16.0 * ux
                    if min(qx, ex) < 0.0 or min(qy, ey) < 0.0 or max(qx, ex) >= columns - 1 or max(qy, ey) >= rows - 1:
                        continue
                    for j in range(17):
                        x, y = qx - uy * j, qy + ux * j
                        ix, iy = int(x), int(y)
                        fx, fy = x - ix, y - iy
                        top = luma[iy, ix] * (1 - fx) + luma[iy, ix + 1] * fx
                        bottom = luma[iy + 1, ix] * (1 - fx) + luma[iy + 1, ix + 1] * fx
                        profile[j] = top * (1 - fy) + bottom * fy
                    level = tilt = 0.0
                    for j in range(3):
                        level += (profile[j] + profile[16 - j]) / 6.0
                        tilt += (profile[16 - j] - profile[j]) / 42.0
                    for j in range(11):
                        g = ridge_of[j]
                        rest_of[k, j] = profile[j + 3] - level - tilt * (j - 5.0)
                        hh += g * g
                        hp += g * rest_of[k, j]
                    used += 1
                if used < 12:
                    return False
                height = hp / hh
                for k in range(sections):
                    if np.isnan(rest_of[k, 0]):
                        continue
                    lever = start + (k + 0.5) * (end - start) / sections - middle
                    for j in range(11):
                        rest = rest_of[k, j] - height * ridge_of[j]
                        if abs(rest) > 1.5 * abs(height) + 12.0:
                            continue
                        slope = height * ridge_of[j] * (j - 5.0) / width2
                        n00 += slope * slope
                        n01 += slope * slope * lever
                        n11 += slope * slope * lever * lever
                        r0 += slope * rest
                        r1 += slope * rest * lever
                        squares += rest * rest
                        count += 1
                determinant = n00 * n11 - n01 * n01
                if count < 60 or not determinant > 1e-12 * n00 * n11:
                    return False
                da = (r0 * n11 - r1 * n01) / determinant
                db = (r1 * n00 - r0 * n01) / determinant
                a += min(2.0, max(-2.0, da))
                b += min(0.05, max(-0.05, db))
                if abs(da) < 0.02 and abs(db) * (end - start) < 0.02:
                    break
            noise = np.sqrt(squares / count)
            if abs(height) * np.sqrt(hh) < 8.0 * noise or abs(height) < 1.5:
                return False
        # decorrelate: the point at which place and direction are independent
        lever = n01 / n00
        at = middle + lever
        across = a + b * lever
        # across is along (−uy, ux); the line's direction from bob to pivot turns by b towards it
        dx, dy = ux - uy * b, uy + ux * b
        norm = np.sqrt(dx * dx + dy * dy)
        out[0] = bx + ux * at - uy * across
        out[1] = by + uy * at + ux * across
        out[2] = np.arctan2(-dx / norm, -dy / norm)
        out[3] = noise / np.sqrt(max(1e-30, n11 - n01 * n01 / n00))
        out[4] = noise / np.sqrt(n00)
        out[5] = abs(height) * np.sqrt(hh) / noise
        return True

    return ridge
