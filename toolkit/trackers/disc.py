"""Disc fit with motion blur: least squares of a shaded disc with a soft edge, smeared along its motion, over the
background that the clip has shown, on a ring of pixels about the outline.

Model of a pixel: g·back·(1 − α) + (f0 + fx·dx/R + fy·dy/R)·α, with α the mean over the streak of the edge function
E((R − d)/h). E is the integral of the biweight kernel (compact, variance h²/7: no exponential to evaluate).
Gauss–Newton over (cx, cy, f0, fx, fy, g) and, when calibrating, (R, h); pixels far off the model do not count.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from toolkit.trackers.localiser import NOWHERE, Guess, Localiser, Look, Patch, Place

_H_PER_SIGMA = np.sqrt(7.0)
SECTORS = 24


@cache
def compiled() -> Any:
    """The compiled fit (compiled at the first call ever, then from the disk).

    fit(image, back, seen, start (cx, cy, R, s), streak (bx, by), string_rad, string_half_rad, noise, free, turns, out)
    with free 6 (centre, shading, gain) or 8 (and R, s). Writes out = cx, cy, R, s, var_x, var_y, cov_xy, misfit,
    visible, contrast, gain, pixels; returns False where the normal equations are singular or the centre left the patch.
    """
    import numba

    @numba.njit(cache=True, nogil=True, error_model="numpy")
    def fit(image, back, seen, start, streak, string_rad, string_half_rad, noise, free, turns, out):  # type: ignore[no-untyped-def]
        rows, columns = image.shape
        cx, cy, radius, soft = start[0], start[1], start[2], start[3] * 2.6457513110645907
        bx, by = streak[0], streak[1]
        length = np.sqrt(bx * bx + by * by)
        samples = 1 + int(min(11.0, np.ceil(length / max(0.4 * soft, 0.7) - 0.5)))
        normal = np.zeros((8, 8))
        right = np.zeros(8)
        step = np.zeros(8)
        slope = np.zeros(8)
        good = np.zeros(24)
        total = np.zeros(24)
        lower = np.zeros((8, 8))
        f0 = fx = fy = 0.0
        gain = 1.0
        has_string = not np.isnan(string_rad)
        sx, sy = np.cos(string_rad), np.sin(string_rad)
        string_cos = np.cos(string_half_rad)
        misfit = 0.0
        count = 0
        weights = 0.0
        wall = 0.0
        last = False
        for turn in range(turns + 1):
            last = last or turn == turns
            normal[:] = 0.0
            right[:] = 0.0
            good[:] = 0.0
            total[:] = 0.0
            squares = 0.0
            weights = 0.0
            count = 0
            wall = 0.0
            walls = 0
            reach = soft + 1.5 + 0.5 * length
            outer, inner = radius + reach, max(0.0, radius - reach)
            x0, x1 = max(0, int(np.floor(cx - outer))), min(columns - 1, int(np.ceil(cx + outer)))
            y0, y1 = max(0, int(np.floor(cy - outer))), min(rows - 1, int(np.ceil(cy + outer)))
            if not (x1 - x0 > 2 and y1 - y0 > 2):
                return False
            cut = np.inf
            if turn > 0:
                cut = max(5.0 * noise, 0.25 * abs(f0 - gain * out[12]))
            for row in range(y0, y1 + 1):
                dy = row - cy
                for column in range(x0, x1 + 1):
                    dx = column - cx
                    square = dx * dx + dy * dy
                    if square > outer * outer or square < inner * inner:
                        continue
                    if has_string:
                        along = dx * sx + dy * sy
                        if along > 0.0 and along > string_cos * np.sqrt(square):
                            continue
                    alpha = gx = gy = gr = gh = 0.0
                    for k in range(samples):
                        u = (k + 0.5) / samples - 0.5
                        ex = dx - u * bx
                        ey = dy - u * by
                        d = np.sqrt(ex * ex + ey * ey) + 1e-9
                        v = (radius - d) / soft
                        if v >= 1.0:
                            alpha += 1.0
                        elif v > -1.0:
                            v2 = v * v
                            alpha += 0.5 + 0.9375 * v * (1.0 - v2 * (0.6666666666666666 - 0.2 * v2))
                            peak = 0.9375 * (1.0 - v2) * (1.0 - v2) / soft
                            gx += peak * ex / d
                            gy += peak * ey / d
                            gr += peak
                            gh -= peak * v
                    alpha /= samples
                    wall_here = back[row, column]
                    pixel = image[row, column]
                    inside = f0 + fx * dx / radius + fy * dy / radius
                    contrast = (inside - gain * wall_here) / samples
                    slope[0] = contrast * gx - alpha * fx / radius
                    slope[1] = contrast * gy - alpha * fy / radius
                    slope[2] = alpha
                    slope[3] = alpha * dx / radius
                    slope[4] = alpha * dy / radius
                    slope[5] = (1.0 - alpha) * wall_here
                    slope[6] = contrast * gr
                    slope[7] = contrast * gh
                    rest = pixel - gain * wall_here * (1.0 - alpha) - inside * alpha
                    if turn == 0:  # linear in shading and gain, the centre held: a start for those
                        slope[0] = slope[1] = slope[6] = slope[7] = 0.0
                        rest = pixel - wall_here * (1.0 - alpha)
                    if alpha < 0.5:
                        wall += wall_here
                        walls += 1
                    n = seen[row, column]
                    bare = (1.0 - alpha) * (1.0 - alpha)
                    weight = 1.0 / (1.0 + bare / n) if n > 0 else 1.0 / (1.0 + 3.0 * bare)
                    sector = int((np.arctan2(dy, dx) + np.pi) * 3.8197186342054885) if last else 0
                    if last:
                        sector = min(23, max(0, sector))
                        total[sector] += 1.0
                    count += 1
                    if abs(rest) > cut:
                        continue
                    if last:
                        good[sector] += 1.0
                    squares += weight * rest * rest
                    weights += weight
                    for a in range(free):
                        wa = weight * slope[a]
                        right[a] += wa * rest
                        for b in range(a + 1):
                            normal[a, b] += wa * slope[b]
            if count < 12 or weights < 6.0:
                return False
            out[12] = wall / max(walls, 1)
            if turn == 0:
                normal[0, 0] = normal[1, 1] = 1.0
                if free > 6:
                    normal[6, 6] = normal[7, 7] = 1.0
            for a in range(free):  # Cholesky
                normal[a, a] *= 1.0 + 1e-9
                for b in range(a + 1):
                    value = normal[a, b]
                    for c in range(b):
                        value -= lower[a, c] * lower[b, c]
                    if a == b:
                        if not value > 1e-12 * normal[a, a]:
                            return False
                        lower[a, a] = np.sqrt(value)
                    else:
                        lower[a, b] = value / lower[b, b]
            misfit = np.sqrt(squares / max(1.0, weights - free))
            if last:
                break
            for a in range(free):
                value = right[a]
                for b in range(a):
                    value -= lower[a, b] * step[b]
                step[a] = value / lower[a, a]
            for a in range(free - 1, -1, -1):
                value = step[a]
                for b in range(a + 1, free):
                    value -= lower[b, a] * step[b]
                step[a] = value / lower[a, a]
            if turn == 0:
                f0, fx, fy, gain = step[2], step[3], step[4], 1.0 + step[5]
                continue
            size = np.sqrt(step[0] * step[0] + step[1] * step[1])
            most = 0.5 * soft + 0.3 * length
            damp = 1.0 if size <= most else most / size
            cx += damp * step[0]
            cy += damp * step[1]
            f0 += damp * step[2]
            fx += damp * step[3]
            fy += damp * step[4]
            gain += damp * step[5]
            if free > 6:
                radius += min(max(damp * step[6], -0.2 * radius), 0.2 * radius)
                soft = min(max(soft + damp * step[7], 0.8), 1.2 * radius)
            if not (0.0 <= cx <= columns - 1.0 and 0.0 <= cy <= rows - 1.0):
                return False
            still = size < 0.02
            if free > 6:
                still = still and abs(step[6]) < 0.02 and abs(step[7]) < 0.05
            if turn + 1 == turns and not still and free == 6 and not (damp == 1.0 and size < 0.3):
                return False  # it has not arrived
            last = still
        # covariance of (cx, cy): solve for the first two unit vectors
        for which in range(2):
            for a in range(free):
                value = 1.0 if a == which else 0.0
                for b in range(a):
                    value -= lower[a, b] * step[b]
                step[a] = value / lower[a, a]
            for a in range(free - 1, -1, -1):
                value = step[a]
                for b in range(a + 1, free):
                    value -= lower[b, a] * step[b]
                step[a] = value / lower[a, a]
            if which == 0:
                out[4] = step[0] * misfit * misfit
                out[6] = step[1] * misfit * misfit
            else:
                out[5] = step[1] * misfit * misfit
        used = seen_sectors = 0.0
        for k in range(24):
            if total[k] > 0.0:
                used += 1.0
                if good[k] > 0.7 * total[k]:
                    seen_sectors += 1.0
        out[0], out[1], out[2], out[3] = cx, cy, radius, soft / 2.6457513110645907
        out[7], out[8], out[9], out[10], out[11] = (
            misfit,
            seen_sectors / max(used, 1.0),
            f0 - gain * out[12],
            gain,
            count,
        )
        return True

    return fit


def fit_disc(
    patch: Patch, look: Look, guess: Guess, *, calibrate: bool = False, turns: int = 7, soften: float = 1.0
) -> np.ndarray | None:
    """(cx, cy, R, s, var_x, var_y, cov_xy, misfit, visible, contrast, gain, pixels, wall) in patch pixels, or None.

    `calibrate` lets radius and edge go free; `soften` widens the edge, and with it the range of capture.
    """
    out = np.zeros(13)
    start = np.array((guess.x_px - patch.x_px, guess.y_px - patch.y_px, look.radius_px, look.edge_px * soften))
    streak = np.array((guess.streak_x_px, guess.streak_y_px))
    half = min(0.9, 0.2 + 3.0 / look.radius_px)
    good = compiled()(
        patch.image,
        patch.back,
        patch.seen,
        start,
        streak,
        guess.string_rad,
        half,
        look.noise,
        8 if calibrate else 6,
        turns,
        out,
    )
    return out if good and np.all(np.isfinite(out)) else None


def locate(patch: Patch, look: Look, guess: Guess) -> Place:
    """The bob's centre by the disc fit; radius and edge are those of `look`."""
    out = fit_disc(patch, look, guess)
    if out is None or out[4] <= 0 or out[5] <= 0:
        return NOWHERE
    return Place(
        out[0] + patch.x_px, out[1] + patch.y_px, float(np.sqrt(out[4])), float(np.sqrt(out[5])), out[7], out[8], out[9]
    )


LOCALISER = Localiser("disc", "least squares of a shaded disc with a soft edge and motion blur (default)", locate)
