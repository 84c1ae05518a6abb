"""The compiled inside of the disc fit.

`gather` lists the pixels that matter, `cover` says how much of each the bob hides, `fit` steps towards the least sum of
squares until the disc lies still. The loops over the lists are plain and write one to three of them each, for then the
compiler makes vector instructions of them. Module-level functions, because a closure that calls other compiled functions
is compiled anew in every process.
"""

from __future__ import annotations

import numba
import numpy as np

# The edge is the integral of the compact kernel (1 − v²)² (A + B v² + C v⁴) / h, v = depth/h, fitted to the normal
# distribution (to 0.001 of its integral). As polynomials in q = v²: E = 1/2 + v (E0 + E1 q + …), its integral over v
# from 0 is v/2 + q (I0 + I1 q + …).
_A, _B, _C = 1.2671444456449772, -3.4568857330475984, 3.448123840312871
H_PER_SIGMA = 3.2089677624128700
K0, K1, K2, K3, K4 = _A, _B - 2 * _A, _A - 2 * _B + _C, _B - 2 * _C, _C
E0, E1, E2, E3, E4 = K0, K1 / 3, K2 / 5, K3 / 7, K4 / 9
I0, I1, I2, I3, I4 = E0 / 2, E1 / 4, E2 / 6, E3 / 8, E4 / 10
MARGIN = 0.8  # px that the outline may move before the pixels are listed anew
SECTORS = 24
_SUMS_IN_ANY_ORDER = {"reassoc", "contract", "nsz"}


@numba.njit(cache=True, nogil=True, error_model="numpy")
def gather(image, back, seen, disc, streak, string, inside, x, y, bright, wall, doubt):
    """List the pixels about the outline and, if `inside`, every second one of every second row within it; their number.

    disc : cx, cy, R, h.    string : its direction and the squared cosine of the half angle of the wedge left out.
    doubt : variance of the wall's level in units of the noise's.
    """
    rows, columns = image.shape
    cx, cy, radius, soft = disc[0], disc[1], disc[2], disc[3]
    length = np.sqrt(streak[0] * streak[0] + streak[1] * streak[1])
    bend = 0.125 * length * length / radius  # by which a streak's ends leave the tangent
    band = soft + MARGIN + bend
    outer, inner = radius + band + 0.5 * length, max(0.0, radius - band - 0.5 * length)
    count = 0
    for row in range(max(0, int(np.ceil(cy - outer))), min(rows - 1, int(np.floor(cy + outer))) + 1):
        dy = row - cy
        half = np.sqrt(max(0.0, outer * outer - dy * dy))
        hole = np.sqrt(max(0.0, inner * inner - dy * dy))
        skips = not inside or row & 1
        column = max(0, int(np.ceil(cx - half))) - 1
        last = min(columns - 1, int(np.floor(cx + half)))
        while column < last and count < x.size:
            column += 1
            dx = column - cx
            if skips and -hole < dx < hole:
                column = int(np.floor(cx + hole))
                continue
            square = dx * dx + dy * dy
            along = dx * string[0] + dy * string[1]
            if along > 0.0 and along * along > string[2] * square:
                continue
            if length > 0.0:  # across its way the streak is narrow
                d = np.sqrt(square) + 1e-9
                near = band + 0.5 * abs(streak[0] * dx + streak[1] * dy) / d
                if d > radius + near or (d < radius - near and (skips or column & 1)):
                    continue
            elif column & 1 and square < inner * inner:
                continue
            x[count], y[count], bright[count], wall[count] = column, row, image[row, column], back[row, column]
            n = seen[row, column]
            doubt[count] = 1.0 / n if n > 0.0 else 3.0
            count += 1
    return count


@numba.njit(cache=True, nogil=True, error_model="numpy", fastmath=_SUMS_IN_ANY_ORDER)
def measure_depth(x, y, cx, cy, radius, soft, depth, nearness):
    """How deep each pixel lies within the outline, in h, and one over its distance from the centre."""
    narrow = 1.0 / soft
    for i in range(x.size):
        dx, dy = x[i] - cx, y[i] - cy
        square = dx * dx + dy * dy + 1e-18
        one = 1.0 / np.sqrt(square)
        depth[i] = (radius - one * square) * narrow
        nearness[i] = one


@numba.njit(cache=True, nogil=True, error_model="numpy", fastmath=_SUMS_IN_ANY_ORDER)
def cover_still(depth, soft, share, rise, widen):
    """Add what a disc at rest covers of each pixel, and its slopes with the radius and with h."""
    narrow = 1.0 / soft
    for i in range(depth.size):
        v = min(1.0, max(-1.0, depth[i]))
        q = v * v
        e = narrow * (K0 + q * (K1 + q * (K2 + q * (K3 + q * K4))))
        share[i] += 0.5 + v * (E0 + q * (E1 + q * (E2 + q * (E3 + q * E4))))
        rise[i] += e
        widen[i] -= e * v


@numba.njit(cache=True, nogil=True, error_model="numpy", fastmath=_SUMS_IN_ANY_ORDER)
def cover_piece(before, after, lift, part, soft, share, rise, widen):
    """Add what it covers while the depth goes evenly from `before` to `after`, in `part` of the exposure."""
    for i in range(before.size):
        a, b = before[i] + lift[i], after[i] + lift[i]
        pa, pb = min(1.0, max(-1.0, a)), min(1.0, max(-1.0, b))
        qa, qb = pa * pa, pb * pb
        # the edge function's integral at both ends, which goes on straight beyond ±1
        ia = 0.5 * (a + abs(a - pa)) + qa * (I0 + qa * (I1 + qa * (I2 + qa * (I3 + qa * I4))))
        ib = 0.5 * (b + abs(b - pb)) + qb * (I0 + qb * (I1 + qb * (I2 + qb * (I3 + qb * I4))))
        v = min(1.0, max(-1.0, 0.5 * (a + b)))
        q = v * v
        middle = 0.5 + v * (E0 + q * (E1 + q * (E2 + q * (E3 + q * E4))))
        share[i] += part * (middle if abs(b - a) < 1e-3 else (ib - ia) / (b - a))
    narrow = part / soft
    for i in range(before.size):
        a, b = before[i] + lift[i], after[i] + lift[i]
        pa, pb = min(1.0, max(-1.0, a)), min(1.0, max(-1.0, b))
        qa, qb = pa * pa, pb * pb
        ea = pa * (E0 + qa * (E1 + qa * (E2 + qa * (E3 + qa * E4))))
        eb = pb * (E0 + qb * (E1 + qb * (E2 + qb * (E3 + qb * E4))))
        v = min(1.0, max(-1.0, 0.5 * (a + b)))
        q = v * v
        middle = K0 + q * (K1 + q * (K2 + q * (K3 + q * K4)))
        e = narrow * (middle if abs(b - a) < 1e-3 else (eb - ea) / (b - a))
        rise[i] += e
        widen[i] -= e * v


@numba.njit(cache=True, nogil=True, error_model="numpy")
def cover(x, y, disc, streak, share, rise, widen, nearness, before, after, lift):
    """What the disc covers of each pixel in the mean over the exposure, and its slopes; along the streak the depth is
    taken as linear in each of a few pieces, lifted by the mean of how far its curve is above them."""
    cx, cy, radius, soft = disc[0], disc[1], disc[2], disc[3]
    for i in range(x.size):
        share[i] = rise[i] = widen[i] = 0.0
    length = np.sqrt(streak[0] * streak[0] + streak[1] * streak[1])
    if length >= 0.05:
        pieces = 1 + int(min(15.0, length / np.sqrt(radius + 1.0)))
        measure_depth(x, y, cx, cy, radius, soft, after, nearness)
        for i in range(x.size):
            across = (streak[0] * (y[i] - cy) - streak[1] * (x[i] - cx)) * nearness[i] / pieces
            lift[i] = across * across * nearness[i] / (12.0 * soft)
        for k in range(pieces + 1):
            u = k / pieces - 0.5
            measure_depth(x, y, cx + u * streak[0], cy + u * streak[1], radius, soft, after, nearness)
            if k:
                cover_piece(before, after, lift, 1.0 / pieces, soft, share, rise, widen)
            before, after = after, before
    measure_depth(x, y, cx, cy, radius, soft, after, nearness)
    if length < 0.05:
        cover_still(after, soft, share, rise, widen)


@numba.njit(cache=True, nogil=True, error_model="numpy", fastmath=_SUMS_IN_ANY_ORDER)
def compare(x, y, bright, wall, doubt, disc, shade, cut, share, rise, widen, nearness, slope, rest, weight):
    """Slopes of the model with all eight parameters, what it leaves of the picture, and each pixel's weight."""
    cx, cy, unit = disc[0], disc[1], 1.0 / disc[2]
    f0, fx, fy, gain = shade[0], shade[1] * unit, shade[2] * unit, shade[3]
    step = slope[6]
    for i in range(x.size):
        step[i] = f0 + fx * (x[i] - cx) + fy * (y[i] - cy)
    for i in range(x.size):
        rest[i] = bright[i] - gain * wall[i] * (1.0 - share[i]) - step[i] * share[i]
    for i in range(x.size):
        bare = 1.0 - share[i]
        weight[i] = 1.0 / (1.0 + doubt[i] * bare * bare) if abs(rest[i]) <= cut else 0.0
    for i in range(x.size):
        step[i] -= gain * wall[i]
        slope[7, i] = step[i] * widen[i]
    for i in range(x.size):
        step[i] *= rise[i]
    for i in range(x.size):
        slope[0, i] = step[i] * (x[i] - cx) * nearness[i] - share[i] * fx
    for i in range(x.size):
        slope[1, i] = step[i] * (y[i] - cy) * nearness[i] - share[i] * fy
    for i in range(x.size):
        slope[2, i] = share[i]
        slope[3, i] = share[i] * (x[i] - cx) * unit
    for i in range(x.size):
        slope[4, i] = share[i] * (y[i] - cy) * unit
        slope[5, i] = (1.0 - share[i]) * wall[i]


@numba.njit(cache=True, nogil=True, error_model="numpy", fastmath=_SUMS_IN_ANY_ORDER)
def normal_equations(slope, weight, rest, free, normal, right, weighted):
    """Fill normal (the lower half) and right; the weighted sum of squares."""
    squares = 0.0
    for i in range(rest.size):
        squares += weight[i] * rest[i] * rest[i]
    for a in range(free):
        total = 0.0
        for i in range(rest.size):
            weighted[i] = slope[a, i] * weight[i]
            total += weighted[i] * rest[i]
        right[a] = total
        for b in range(a + 1):
            total = 0.0
            for i in range(rest.size):
                total += weighted[i] * slope[b, i]
            normal[a, b] = total
    return squares


@numba.njit(cache=True, nogil=True, error_model="numpy")
def decompose(normal, lower, free):
    """Cholesky; False where singular. A parameter on which nothing depends stays where it is."""
    for a in range(free):
        for b in range(a + 1):
            value = normal[a, b] * (1.0 + 1e-9) if a == b else normal[a, b]
            if a == b and value == 0.0:
                lower[a, a] = 1.0
                continue
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


@numba.njit(cache=True, nogil=True, error_model="numpy")
def look_around(x, y, share, wall, rest, disc, clean):
    """In how much of the outline's sectors the bob was seen (the model is off by `clean` at most), the mean level of the
    wall beside it, and the misfit (rms, each pixel's at most 2 `clean`) well inside; NaN where no such pixel was listed.

    What hides the bob is seen on it, what stands behind it only beside it: pixels that are the bob's for the most part count.
    """
    good, total = np.zeros(SECTORS), np.zeros(SECTORS)
    level = squares = 0.0
    beside = within = 0
    for i in range(x.size):
        if share[i] < 0.5:
            level += wall[i]
            beside += 1
            continue
        dx, dy = x[i] - disc[0], y[i] - disc[1]
        turn = dy / (abs(dx) + abs(dy) + 1e-12)  # sectors of equal diamond angle: no arctangent
        sector = int((1.0 + turn if dx >= 0.0 else 3.0 - turn) * (0.25 * SECTORS - 1e-6))
        total[sector] += 1.0
        good[sector] += abs(rest[i]) <= clean
        if dx * dx + dy * dy < 0.64 * disc[2] * disc[2] and share[i] > 0.999:
            squares += min(abs(rest[i]), 2.0 * clean) ** 2
            within += 1
    clear = present = 0
    for k in range(SECTORS):
        present += total[k] > 0.0
        clear += total[k] > 0.0 and good[k] > 0.7 * total[k]
    return (
        clear / max(1, present),
        level / beside if beside else np.nan,
        np.sqrt(squares / within) if within else np.nan,
    )


# one signature for patches of any layout: each would be compiled by itself, and this is the longest to compile
_picture, _column, _number, _count = numba.float32[:, :], numba.float64[::1], numba.float64, numba.int64
_SIGNATURE = numba.boolean(
    _picture, _picture, _picture, _column, _column, _column, _number, _number, _count, numba.boolean, _count, _column
)


@numba.njit(_SIGNATURE, cache=True, nogil=True, error_model="numpy")
def fit(image, back, seen, start, streak, string, noise, contrast, free, inside, turns, out):
    """Fit the disc; False where it did not settle: singular normal equations, the centre left the patch, or the steps
    did not become small.

    start : cx, cy, R, s.    streak : bx, by.    string : see `gather`.    contrast : bob less wall, 0 if unknown.
    free : 6 (centre, shading, gain), 7 (and R) or 8 (and s).
    out : cx, cy, R, s, var_x, var_y, cov_xy, misfit, visible, contrast, gain, pixels, wall, misfit well inside.
    """
    rows, columns = image.shape
    disc, listed = np.empty(4), np.empty(4)  # `listed` is the disc for which the pixels were listed
    for k in range(4):
        disc[k] = start[k] if k < 3 else start[k] * H_PER_SIGMA
    length = np.sqrt(streak[0] * streak[0] + streak[1] * streak[1])
    normal, lower = np.zeros((8, 8)), np.zeros((8, 8))
    right, step = np.zeros(8), np.zeros(8)
    shade = np.zeros(
        4
    )  # f0, fx, fy, gain: all 0 at first where nothing is known, then the first step finds these alone
    first = 0 if contrast != 0.0 else 1  # the first turn on which the centre moves
    lists, slope = np.empty((13, 0)), np.empty((8, 0))
    moved = np.inf
    count = 0
    level, cut = 0.0, np.inf
    settled = False
    for turn in range(turns + first):
        if moved > 0.75 * MARGIN:
            width = 2.0 * (disc[3] + MARGIN) + 1.3 * length + 0.25 * length * length / disc[2]
            room = 6.3 * (disc[2] + 3.0) * width + (0.8 * disc[2] * disc[2] if inside else 0.0) + 64.0
            lists = np.empty((13, int(min(rows * columns, room))))
            count = gather(
                image, back, seen, disc, streak, string, inside, lists[0], lists[1], lists[2], lists[3], lists[4]
            )
            if count < 12:
                return False
            slope = np.empty((8, count))
            for k in range(4):
                listed[k] = disc[k]
        x, y, bright, wall, doubt = (
            lists[0, :count],
            lists[1, :count],
            lists[2, :count],
            lists[3, :count],
            lists[4, :count],
        )
        share, rise, widen, nearness = lists[5, :count], lists[6, :count], lists[7, :count], lists[8, :count]
        rest, weight, spare = lists[9, :count], lists[10, :count], lists[11, :count]
        if turn == 0:
            for i in range(count):
                level += wall[i] / count
            if first == 0:
                shade[0], shade[3] = level + contrast, 1.0
        cover(x, y, disc, streak, share, rise, widen, nearness, spare, lists[12, :count], rest)
        compare(x, y, bright, wall, doubt, disc, shade, cut, share, rise, widen, nearness, slope, rest, weight)
        squares = normal_equations(slope, weight, rest, free, normal, right, spare)
        if not decompose(normal, lower, free):
            return False
        solve(lower, right, step, free)
        size = np.sqrt(step[0] * step[0] + step[1] * step[1])
        most = 0.5 * disc[3] + 0.3 * length
        damp = 1.0 if size <= most else most / size
        disc[0] += damp * step[0]
        disc[1] += damp * step[1]
        for k in range(4):
            shade[k] += damp * step[2 + k]
        still = size < 0.03
        if free > 6:
            disc[2] += min(max(damp * step[6], -0.2 * disc[2]), 0.2 * disc[2])
            still = still and abs(step[6]) < 0.02
        if free > 7:
            disc[3] = min(max(disc[3] + damp * step[7], 0.8), 1.2 * disc[2])
            still = still and abs(step[7]) < 0.05
        if not (0.0 <= disc[0] <= columns - 1.0 and 0.0 <= disc[1] <= rows - 1.0):
            return False
        moved = 0.0
        for k in range(4):
            moved = max(moved, abs(disc[k] - listed[k]))
        settled = still or free == 8 or (damp == 1.0 and size < 0.3)
        if still and cut < np.inf:
            break
        if turn >= first:
            cut = max(5.0 * noise, 0.25 * abs(shade[0] - shade[3] * level))
    weights = gained = 0.0
    for i in range(count):
        weights += weight[i]
    for a in range(free):  # by the last step, which was not looked at again
        gained += (2.0 - damp) * damp * step[a] * right[a]
    visible, level, within = look_around(
        x, y, share, wall, rest, disc, max(5.0 * noise, 0.12 * abs(shade[0] - shade[3] * level))
    )
    if not settled or weights < 6.0 or np.isnan(level):
        return False
    misfit = np.sqrt(max(0.0, squares - gained) / max(1.0, weights - free))
    for which in range(2):  # covariance of the centre: solve for the first two unit vectors
        for k in range(8):
            right[k] = 1.0 if k == which else 0.0
        solve(lower, right, step, free)
        out[4 + which] = step[which] * misfit * misfit
        out[6] = step[1 - which] * misfit * misfit
    out[0], out[1], out[2], out[3] = disc[0], disc[1], disc[2], disc[3] / H_PER_SIGMA
    out[7], out[8], out[9], out[10] = misfit, visible, shade[0] - shade[3] * level, shade[3]
    out[11], out[12], out[13] = count, level, within
    return True
