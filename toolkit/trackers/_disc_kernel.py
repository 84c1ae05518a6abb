"""The compiled inside of the disc fit. Compiled at the first call ever, then loaded from the disk.

Module-level functions, because a closure that calls other compiled functions is compiled anew in every process.
"""

from __future__ import annotations

import numba
import numpy as np


@numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"reassoc", "contract", "nsz"})
def products(slope, weight, rest, count, free, normal, right, weighted):
    for a in range(free):
        for i in range(count):
            weighted[i] = slope[a, i] * weight[i]
        total = 0.0
        for i in range(count):
            total += weighted[i] * rest[i]
        right[a] = total
        for b in range(a + 1):
            total = 0.0
            for i in range(count):
                total += weighted[i] * slope[b, i]
            normal[a, b] = total


@numba.njit(cache=True, nogil=True, error_model="numpy")
def decompose(normal, lower, free):
    for a in range(free):
        for b in range(a + 1):
            value = normal[a, b] * (1.0 + 1e-9) if a == b else normal[a, b]
            for c in range(b):
                value -= lower[a, c] * lower[b, c]
            if a == b:
                if not value > 1e-12 * normal[a, a]:
                    return False
                lower[a, a] = np.sqrt(value)
            else:
                lower[a, b] = value / lower[b, b]
    return True


@numba.njit(cache=True, nogil=True, error_model="numpy")
def solve(lower, right, step, free):
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


# one signature for patches of any layout: each would be compiled by itself, and this is the longest to compile
_picture, _column, _number, _count = numba.float32[:, :], numba.float64[::1], numba.float64, numba.int64
_SIGNATURE = numba.boolean(
    _picture, _picture, _picture, _column, _column, _number, _number, _number, _number, _count, _count, _column
)


@numba.njit(_SIGNATURE, cache=True, nogil=True, error_model="numpy")
def fit(image, back, seen, start, streak, string_rad, string_half_rad, noise, contrast, free, turns, out):
    """Fit the disc; False where it did not settle: singular normal equations, the centre left the patch, or the steps
    did not become small.

    start : cx, cy, R, s.    streak : bx, by.    free : 6 (centre, shading, gain), 7 (and R) or 8 (and s).
    out : cx, cy, R, s, var_x, var_y, cov_xy, misfit, visible, contrast, gain, pixels, wall.
    """
    rows, columns = image.shape
    cx, cy, radius, soft = start[0], start[1], start[2], start[3] * 2.6457513110645907
    bx, by = streak[0], streak[1]
    length = np.sqrt(bx * bx + by * by)
    # along the streak the distance to the edge is taken as linear in each of a few pieces
    pieces = 1 + int(min(15.0, length / np.sqrt(radius + 1.0)))
    bend = 0.125 * length * length / radius
    share = 1.0 / pieces
    room = int(min(rows * columns, 6.3 * (radius + 3.0) * (2.0 * soft + 4.0 + 1.3 * length + 2.0 * bend) + 64)) | 1
    slope = np.empty((8, room))
    rest = np.empty(room)
    weight = np.empty(room)
    spare = np.empty(room)
    normal = np.zeros((8, 8))
    lower = np.zeros((8, 8))
    right = np.zeros(8)
    step = np.zeros(8)
    good = np.zeros(24)
    total = np.zeros(24)
    has_string = not np.isnan(string_rad)
    sx, sy = np.cos(string_rad), np.sin(string_rad)
    string_cos = np.cos(string_half_rad)
    f0 = fx = fy = 0.0
    gain = 1.0
    known = contrast != 0.0
    first = 1 if known else 0  # turn 0, the centre held, finds shading and gain where nothing is known of them
    misfit = wall = 0.0
    count = 0
    last = False
    for turn in range(first, turns + 1):
        last = last or turn == turns
        reach = soft + 1.5 + 0.5 * length
        outer, inner = radius + reach, max(0.0, radius - reach)
        y0, y1 = max(0, int(np.ceil(cy - outer))), min(rows - 1, int(np.floor(cy + outer)))
        if y1 - y0 < 3:
            return False
        if known and turn == 1:
            level, number = 0.0, 0
            row = min(max(int(cy), 0), rows - 1)
            for x in (max(0, int(cx - outer)), min(columns - 1, int(cx + outer))):
                level += back[row, x]
                number += 1
            wall = level / number
            f0 = wall + contrast
        cut = np.inf
        if turn > 1:
            cut = max(5.0 * noise, 0.25 * abs(f0 - gain * wall))
        squares = weights = walls = 0.0
        count = taken = beyond = 0
        unit = 1.0 / radius
        if last:
            good[:] = 0.0
            total[:] = 0.0
        for row in range(y0, y1 + 1):
            dy = row - cy
            half = np.sqrt(max(0.0, outer * outer - dy * dy))
            hole = np.sqrt(max(0.0, inner * inner - dy * dy))
            x0, x1 = max(0, int(np.ceil(cx - half))), min(columns - 1, int(np.floor(cx + half)))
            column = x0 - 1
            while column < x1:
                column += 1
                dx = column - cx
                if hole > 0.0 and -hole < dx < hole:
                    column = int(np.floor(cx + hole))
                    continue
                d = np.sqrt(dx * dx + dy * dy) + 1e-9
                if has_string:
                    along = dx * sx + dy * sy
                    if along > 0.0 and along > string_cos * d:
                        continue
                alpha = gr = gh = 0.0
                one = 1.0 / d
                hx, hy = dx * one, dy * one
                # how far the streak carries the edge across this pixel, and how its bend adds to that
                swept = 0.5 * abs(bx * hx + by * hy) + bend
                off = d - radius
                if abs(off) > swept + soft + 1.5:
                    continue
                if off >= swept + soft:
                    alpha = 0.0
                elif off <= -swept - soft:
                    alpha = 1.0
                elif length < 0.05:
                    v = min(1.0, max(-1.0, (radius - d) / soft))
                    v2 = v * v
                    alpha = 0.5 + 0.9375 * v * (1.0 - v2 * (0.6666666666666666 - 0.2 * v2))
                    gr = 0.9375 * (1.0 - v2) * (1.0 - v2) / soft
                    gh = -gr * v
                else:
                    ex, ey = dx + 0.5 * bx, dy + 0.5 * by
                    va = (radius - np.sqrt(ex * ex + ey * ey)) / soft
                    for k in range(1, pieces + 1):
                        u = k * share - 0.5
                        ex, ey = dx - u * bx, dy - u * by
                        vb = (radius - np.sqrt(ex * ex + ey * ey)) / soft
                        if va >= 1.0 and vb >= 1.0:
                            alpha += 1.0
                        elif va > -1.0 or vb > -1.0:
                            if abs(vb - va) > 1e-3:
                                slant = 1.0 / (vb - va)
                                pa, pb = min(1.0, max(-1.0, va)), min(1.0, max(-1.0, vb))
                                qa, qb = pa * pa, pb * pb
                                # the edge function's integral, and the edge function itself, at both ends
                                ia = 0.5 * va + 0.9375 * qa * (
                                    0.5 - qa * (0.16666666666666666 - 0.03333333333333333 * qa)
                                )
                                ib = 0.5 * vb + 0.9375 * qb * (
                                    0.5 - qb * (0.16666666666666666 - 0.03333333333333333 * qb)
                                )
                                ia += 0.5 * abs(va - pa)
                                ib += 0.5 * abs(vb - pb)
                                ea = pa * (1.0 - qa * (0.6666666666666666 - 0.2 * qa))
                                eb = pb * (1.0 - qb * (0.6666666666666666 - 0.2 * qb))
                                alpha += (ib - ia) * slant
                                peak = 0.9375 * (eb - ea) * slant
                            else:
                                v = min(1.0, max(-1.0, 0.5 * (va + vb)))
                                v2 = v * v
                                alpha += 0.5 + 0.9375 * v * (1.0 - v2 * (0.6666666666666666 - 0.2 * v2))
                                peak = 0.9375 * (1.0 - v2) * (1.0 - v2)
                            gr += peak
                            gh -= peak * min(1.0, max(-1.0, 0.5 * (va + vb)))
                        va = vb
                    alpha *= share
                    gr *= share / soft
                    gh *= share / soft
                gx, gy = gr * hx, gr * hy
                wall_here = back[row, column]
                nx, ny = dx * unit, dy * unit
                bare = 1.0 - alpha
                if turn == 0:
                    difference = 0.0
                    off = image[row, column] - wall_here * bare
                else:
                    inside = f0 + fx * nx + fy * ny
                    difference = inside - gain * wall_here
                    off = image[row, column] - gain * wall_here * bare - inside * alpha
                if alpha < 0.5:
                    walls += wall_here
                    beyond += 1
                taken += 1
                keep = abs(off) <= cut
                if last and alpha > 0.5:
                    # what hides the bob is seen on it, what stands behind it only beside it
                    # sectors of equal diamond angle: no arctangent
                    turn_of = dy / (abs(dx) + abs(dy) + 1e-12)
                    sector = int((1.0 + turn_of if dx >= 0.0 else 3.0 - turn_of) * 5.999999)
                    total[sector] += 1.0
                    if keep:
                        good[sector] += 1.0
                if not keep or count == room:
                    continue
                n = seen[row, column]
                w = n / (n + bare * bare) if n > 0.0 else 1.0 / (1.0 + 3.0 * bare * bare)
                slope[0, count] = difference * gx - alpha * fx * unit
                slope[1, count] = difference * gy - alpha * fy * unit
                slope[2, count] = alpha
                slope[3, count] = alpha * nx
                slope[4, count] = alpha * ny
                slope[5, count] = bare * wall_here
                slope[6, count] = difference * gr
                slope[7, count] = difference * gh
                rest[count] = off
                weight[count] = w
                squares += w * off * off
                weights += w
                count += 1
        if count < 12 or weights < 6.0 or beyond == 0:
            return False
        wall = walls / beyond
        products(slope, weight, rest, count, free, normal, right, spare)
        if turn == 0:
            normal[0, 0] = normal[1, 1] = normal[6, 6] = normal[7, 7] = 1.0
        if not decompose(normal, lower, free):
            return False
        misfit = np.sqrt(squares / max(1.0, weights - free))
        if last:
            break
        solve(lower, right, step, free)
        if turn == 0:
            f0, fx, fy, gain = step[2], step[3], step[4], 1.0 + step[5]
            continue
        size = np.sqrt(step[0] * step[0] + step[1] * step[1])
        most = 0.5 * soft + 0.3 * length
        damp = 1.0 if size <= most else most / size
        cx += damp * step[0]
        cy += damp * step[1]
        f0 += step[2]
        fx += damp * step[3]
        fy += damp * step[4]
        gain += damp * step[5]
        still = size < 0.03
        if free > 6:
            radius += min(max(damp * step[6], -0.2 * radius), 0.2 * radius)
            still = still and abs(step[6]) < 0.02
        if free > 7:
            soft = min(max(soft + damp * step[7], 0.8), 1.2 * radius)
            still = still and abs(step[7]) < 0.05
        if not (0.0 <= cx <= columns - 1.0 and 0.0 <= cy <= rows - 1.0):
            return False
        if turn + 1 == turns and not still and free < 8 and not (damp == 1.0 and size < 0.3):
            return False
        last = still and turn > 1
    for which in range(2):  # covariance of the centre: solve for the first two unit vectors
        right[:] = 0.0
        right[which] = 1.0
        solve(lower, right, step, free)
        out[4 + which] = step[which] * misfit * misfit
        out[6] = step[1 - which] * misfit * misfit
    used = seen_sectors = 0.0
    for k in range(24):
        if total[k] > 0.0:
            used += 1.0
            if good[k] > 0.7 * total[k]:
                seen_sectors += 1.0
    out[0], out[1], out[2], out[3] = cx, cy, radius, soft / 2.6457513110645907
    out[7], out[8], out[9], out[10], out[11], out[12] = (
        misfit,
        seen_sectors / max(used, 1.0),
        f0 - gain * wall,
        gain,
        taken,
        wall,
    )
    return True
