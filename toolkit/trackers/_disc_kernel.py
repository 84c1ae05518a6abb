"""The compiled inside of the disc fit.

`gather` lists the pixels that matter, `cover_still` and `cover_moving` say how much of each the bob hides, `fit` steps
towards the least sum of squares until the disc lies still. Plain pointers and few calls, so that it compiles in seconds;
the listed pixels are worked through in chunks that stay in the processor's nearest memory, in plain loops, for then the
compiler makes vector instructions of them.
"""

from __future__ import annotations

import math
from typing import Any

from numba import njit

from toolkit.motion.kernels.pointer import pixels, reals, skip

# The edge is the integral of the compact kernel (1 − v²)² (A + B v² + C v⁴) / h, v = depth/h, fitted to the normal
# distribution (to 0.001 of its integral). As polynomials in q = v²: E = 1/2 + v (E0 + E1 q + …), its integral over v
# from 0 is v/2 + q (I0 + I1 q + …).
_A, _B, _C = 1.2671444456449772, -3.4568857330475984, 3.448123840312871
H_PER_SIGMA = 3.2089677624128700
K0, K1, K2, K3, K4 = _A, _B - 2 * _A, _A - 2 * _B + _C, _B - 2 * _C, _C
E0, E1, E2, E3, E4 = K0, K1 / 3, K2 / 5, K3 / 7, K4 / 9
I0, I1, I2, I3, I4 = E0 / 2, E1 / 4, E2 / 6, E3 / 8, E4 / 10
STILL = 0.05  # px: the step after such a one is under a fiftieth of it
MARGIN = 0.8  # px that the outline may move before the pixels are listed anew
SECTORS = 24
_P = 8  # parameters: cx, cy, three of the shade, gain, R, h
CHUNK = 128

# The caller's numbers: what is known, then the result from OUT on.
CX, CY, RADIUS, EDGE, STREAK_X, STREAK_Y, BEND_X, BEND_Y, STRING_X, STRING_Y, WEDGE, NOISE, CONTRAST, OUT = range(14)
RESULTS = 14
# The caller's places: addresses of the three pictures, of the numbers and of the room to work in, then whole numbers:
# size, elements from one row to the next, FREE parameters, whether to look INSIDE, most TURNS, MOST pixels.
IMAGE, BACK, SEEN, NUMBERS, ROOM, ROWS, COLUMNS, IMAGE_ROW, BACK_ROW, SEEN_ROW, FREE, INSIDE, TURNS, MOST = range(14)
# The room: lists of MOST pixels, lists of a CHUNK of them, and small things.
_X, _Y, _BRIGHT, _WALL, _KNOWN, _SHARE, _REST, LISTS = range(8)
_SLOPE, _RISE, _WIDEN, _NEAR, _DEPTH, _LIFT, _WEIGHT, _EDGE, _END = (k * CHUNK for k in (0, *range(_P, _P + 8)))
_NORMAL, _RIGHT, _STEP, _DISC, _LISTED, _SHADE = (_END + k for k in (0, 64, 80, 88, 96, 104))
_SECTORS = _SHADE + 8
SPARE = _SECTORS + 2 * SECTORS

_OPTIONS: dict[str, Any] = {
    "error_model": "numpy",
    "no_rewrites": True,
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
}
_once = njit(**_OPTIONS)
loop = njit(**_OPTIONS, fastmath={"reassoc", "contract", "nsz", "arcp"})  # sums in any order


@_once
def gather(places: Any, numbers: Any, lists: Any, disc: Any) -> int:
    """List the pixels about the outline and, if INSIDE, every second one of every second row within it; their number.

    disc : cx, cy, R, h. The string's wedge, left out, is given by its direction and the squared cosine of its half angle,
    negative where the one opposite is left out too;
    `known` is one over the variance of the wall's level, in units of the noise's.
    """
    image, back, seen = pixels(places, IMAGE), pixels(places, BACK), pixels(places, SEEN)
    columns, most = places[COLUMNS], places[MOST]
    x, y, bright = lists, skip(lists, _Y * most), skip(lists, _BRIGHT * most)
    wall, known = skip(lists, _WALL * most), skip(lists, _KNOWN * most)
    cx, cy, radius = disc[0], disc[1], disc[2]
    sx, sy, wedge = numbers[STRING_X], numbers[STRING_Y], abs(numbers[WEDGE])
    spared = 0.0 if numbers[WEDGE] > 0.0 else -math.inf  # what lies less far along the string
    bx, by = 0.5 * numbers[STREAK_X], 0.5 * numbers[STREAK_Y]
    reach = math.sqrt(bx * bx + by * by)
    sweep_along = sweep_aside = 0.0
    if 2.0 * reach > radius:  # the string passes over what is above such a streak, where the bob does not hide it
        sweep_along, sweep_aside = bx * sx + by * sy, bx * sy - by * sx
        spared = max(radius - disc[3] - MARGIN, 0.0) if spared == 0.0 else spared
    qx, qy = numbers[BEND_X], numbers[BEND_Y]
    # a streak's ends leave the tangent, and where a straight one's would be
    band = disc[3] + MARGIN + 0.5 * reach * reach / radius + math.sqrt(qx * qx + qy * qy) / 6.0
    outer, inner = radius + band + reach, radius - band - reach
    count = 0
    for row in range(places[ROWS]):
        dy = row - cy
        half = outer * outer - dy * dy
        if half < 0.0:
            continue
        half = math.sqrt(half)
        hole = inner * abs(inner) - dy * dy
        hole = math.sqrt(hole) if hole > 0.0 else 0.0
        skips = places[INSIDE] == 0 or row & 1 == 1
        image_row, back_row, seen_row = row * places[IMAGE_ROW], row * places[BACK_ROW], row * places[SEEN_ROW]
        first = math.ceil(cx - half) if cx > half else 0
        end = min(math.floor(cx + half) + 1, columns)
        left = min(max(math.ceil(cx - hole), first), end)
        right = min(max(math.ceil(cx + hole), left), end)
        held = abs(sx) * outer + dy * sy > spared  # may the string be in this row?
        for part in range(3):  # the outline, what is within it, the outline
            column, until, step = first, left, 1
            if part == 1:
                if skips:
                    continue
                column, until, step = left + (left & 1), right, 2
            elif part == 2:
                column, until = right, end
            while column < until:
                times = seen[seen_row + column]
                keep = times >= 0.0
                dx = column - cx
                square = dx * dx + dy * dy
                if held:
                    along, aside = dx * sx + dy * sy, dx * sy - dy * sx
                    if abs(sweep_aside) > 1e-3:
                        part_way = min(max(aside / sweep_aside, -1.0), 1.0)
                        along -= part_way * sweep_along
                        aside -= part_way * sweep_aside
                    keep &= (along <= spared) | (along * along <= wedge * (along * along + aside * aside))
                if reach > 0.0:  # across its way the streak is narrow
                    d = math.sqrt(square) + 1e-9
                    off = (d - radius) * d
                    near = band * d + abs(bx * dx + by * dy)
                    keep &= (off <= near) & ((not skips and column & 1 == 0) or off >= -near)
                x[count] = column
                y[count] = row
                bright[count] = image[image_row + column]
                wall[count] = back[back_row + column]
                known[count] = times if times > 0.0 else 1.0 / 3.0
                count += keep
                column += step
    return count


@loop
def mean(values: Any, n: int) -> float:
    total = 0.0
    for i in range(n):
        total += values[i]
    return total / n


@loop
def largest(values: Any, n: int) -> float:
    most = 0.0
    for i in range(n):
        most = abs(values[i]) if abs(values[i]) > most else most
    return most


@loop
def measure_depth(
    x: Any, y: Any, n: int, cx: float, cy: float, radius: float, soft: float, depth: Any, near: Any
) -> None:
    """How deep each pixel lies within the outline, in h, and one over its distance from the centre."""
    for i in range(n):
        dx, dy = x[i] - cx, y[i] - cy
        square = dx * dx + dy * dy + 1e-18
        one = 1.0 / math.sqrt(square)
        depth[i] = (radius - one * square) / soft
        near[i] = one


@loop
def cover_still(
    x: Any, y: Any, n: int, cx: float, cy: float, radius: float, soft: float,
    right: Any, down: Any, share: Any, rise: Any, widen: Any,
) -> None:  # fmt: skip
    """What a disc at rest covers of each pixel, and its slopes with the centre, the radius and h."""
    for i in range(n):
        dx, dy = x[i] - cx, y[i] - cy
        square = dx * dx + dy * dy + 1e-18
        one = 1.0 / math.sqrt(square)
        v = (radius - one * square) / soft
        v = 1.0 if v > 1.0 else -1.0 if v < -1.0 else v
        q = v * v
        share[i] = 0.5 + v * (E0 + q * (E1 + q * (E2 + q * (E3 + q * E4))))
        e = (K0 + q * (K1 + q * (K2 + q * (K3 + q * K4)))) / soft
        rise[i] = e
        widen[i] = -e * v
        e *= one
        right[i] = e * dx
        down[i] = e * dy


@loop
def cover_moving(
    depth: Any, near: Any, lift: Any, n: int, part: float, soft: float, before: Any, edge: Any, whole: Any, closer: Any,
    share: Any, rise: Any, widen: Any, aside: Any,
) -> None:  # fmt: skip
    """Add what it covers while the depth goes evenly from `before` to `depth` in `part` of the exposure (0: only note the
    start): the differences of the edge function's integral and of itself, over the way. `aside`: its slope with the centre
    across the way, over the pixel's distance from the way; `near`, and `closer` before, is one over that from the centre."""
    for i in range(n):
        a = before[i]
        b = depth[i] + lift[i]
        b = b if abs(b - a) > 1e-6 else a + 1e-6
        v = 1.0 if b > 1.0 else -1.0 if b < -1.0 else b
        q = v * v
        level = v * (E0 + q * (E1 + q * (E2 + q * (E3 + q * E4))))
        # the integral goes on straight beyond ±1
        sum_ = 0.5 * (b + abs(b - v)) + q * (I0 + q * (I1 + q * (I2 + q * (I3 + q * I4))))
        one = part / (b - a)
        share[i] += one * (sum_ - whole[i])
        e = one * (level - edge[i]) / soft
        middle = 0.5 * (a + b)
        rise[i] += e
        aside[i] += 0.5 * e * (near[i] + closer[i])
        closer[i] = near[i]
        widen[i] -= e * (1.0 if middle > 1.0 else -1.0 if middle < -1.0 else middle)
        before[i] = b
        edge[i] = level
        whole[i] = sum_


@loop
def lean(
    x: Any,
    y: Any,
    n: int,
    cx: float,
    cy: float,
    bx: float,
    by: float,
    began: Any,
    edge: Any,
    aside: Any,
    right: Any,
    down: Any,
) -> None:
    """The slopes with the centre of what a moving disc covers. Moved along its way it covers what it does a little later: the slope
    is the difference of what it covers at the end and of what it did as it `began`, over the way."""
    one = 1.0 / math.sqrt(bx * bx + by * by)
    ux, uy = bx * one, by * one
    for i in range(n):
        along = (edge[i] - began[i]) * one
        across = aside[i] * ((y[i] - cy) * ux - (x[i] - cx) * uy)
        right[i] = along * ux - across * uy
        down[i] = along * uy + across * ux


@loop
def compare(
    x: Any, y: Any, n: int, bright: Any, wall: Any, known: Any, disc: Any, shade: Any, cut: float,
    share: Any, rest: Any, work: Any, free: int,
) -> None:  # fmt: skip
    """Slopes of the model with all eight parameters, what it leaves of the picture, and each pixel's weight."""
    rise, widen, weight = skip(work, _RISE), skip(work, _WIDEN), skip(work, _WEIGHT)
    right, down = skip(work, _NEAR), skip(work, _DEPTH)
    by_x, by_y, flat, tilt_x = work, skip(work, CHUNK), skip(work, 2 * CHUNK), skip(work, 3 * CHUNK)
    tilt_y, by_gain = skip(work, 4 * CHUNK), skip(work, 5 * CHUNK)
    by_radius, by_soft = skip(work, 6 * CHUNK), skip(work, 7 * CHUNK)
    cx, cy = disc[0], disc[1]
    f0, fx, fy, gain = shade[0], shade[1], shade[2], shade[3]
    for i in range(n):
        dx, dy, part = x[i] - cx, y[i] - cy, share[i]
        level, bare = gain * wall[i], 1.0 - share[i]
        step = f0 + fx * dx + fy * dy - level
        off = bright[i] - level - step * part
        rest[i] = off
        by_gain[i] = bare * wall[i]
        by_soft[i] = step
        weight[i] = known[i] / (known[i] + bare * bare) if abs(off) <= cut else 0.0
    for i in range(n):
        dx, dy, part, step = x[i] - cx, y[i] - cy, share[i], by_soft[i]
        by_radius[i] = step * rise[i]
        flat[i] = part
        by_x[i] = step * right[i] - fx * part
        by_y[i] = step * down[i] - fy * part
        tilt_x[i] = dx * part
        tilt_y[i] = dy * part
    if free == _P:
        for i in range(n):
            by_soft[i] *= widen[i]


@loop
def add_up(work: Any, rest: Any, n: int, free: int, normal: Any, right: Any) -> None:
    """Add a chunk to the normal equations: rows of four, the lower half is what counts. Behind their right side of eight: the
    weighted sum of squares, the sum of the weights."""
    weight = skip(work, _WEIGHT)
    squares = weights = 0.0
    for i in range(n):
        squares += weight[i] * rest[i] * rest[i]
        weights += weight[i]
    right[8] += squares
    right[9] += weights
    for a in range(0, free, 2):
        first, second = skip(work, a * CHUNK), skip(work, (a + 1) * CHUNK)
        for b in range(0, a + 1, 4):
            c0, c1, c2, c3 = (
                skip(work, b * CHUNK), skip(work, (b + 1) * CHUNK), skip(work, (b + 2) * CHUNK), skip(work, (b + 3) * CHUNK)
            )  # fmt: skip
            s0 = s1 = s2 = s3 = t0 = t1 = t2 = t3 = s_rest = t_rest = 0.0
            for i in range(n):
                s, t = weight[i] * first[i], weight[i] * second[i]
                s0 += s * c0[i]
                s1 += s * c1[i]
                s2 += s * c2[i]
                s3 += s * c3[i]
                t0 += t * c0[i]
                t1 += t * c1[i]
                t2 += t * c2[i]
                t3 += t * c3[i]
                s_rest += s * rest[i]
                t_rest += t * rest[i]
            row = skip(normal, _P * a + b)
            row[0] += s0
            row[1] += s1
            row[2] += s2
            row[3] += s3
            row[_P] += t0
            row[_P + 1] += t1
            row[_P + 2] += t2
            row[_P + 3] += t3
            if b == 0:
                right[a] += s_rest
                right[a + 1] += t_rest


@_once
def invert(a: Any, size: int, spare: Any) -> bool:
    """Put the inverse in the place of a positive symmetric matrix of which the lower half is given (Gauss and Jordan); False
    where singular. A parameter on which nothing depends gets a variance of zero."""
    for i in range(size):
        spare[i] = 1e-12 * a[(_P + 1) * i]
        for j in range(i):
            a[_P * j + i] = a[_P * i + j]
    for k in range(size):
        pivot = a[(_P + 1) * k]
        if spare[k] == 0.0:
            continue
        if not pivot > spare[k]:
            return False
        a[(_P + 1) * k] = 1.0
        for j in range(size):
            a[_P * k + j] /= pivot
        for i in range(size):
            if i != k:
                factor = a[_P * i + k]
                a[_P * i + k] = 0.0
                for j in range(size):
                    a[_P * i + j] -= factor * a[_P * k + j]
    return True


@_once
def look_around(
    lists: Any, most: int, count: int, disc: Any, length: float, clean: float, sectors: Any, out: Any
) -> None:
    """out[8] : in how much of the outline's sectors the bob was seen (the model is off by `clean` at most); out[12] : the
    mean level of the wall beside it; out[13] : the misfit (rms, each pixel's at most 2 `clean`) well inside; NaN where no
    such pixel was listed.

    What hides the bob is seen on it, what stands behind it only beside it: pixels that are the bob's for at least half as long as any
    is, while it draws a streak of this `length`, count.
    """
    long = 2.0 * disc[2] / length if length > 2.0 * disc[2] else 1.0
    y, wall, share, rest = (
        skip(lists, _Y * most), skip(lists, _WALL * most), skip(lists, _SHARE * most), skip(lists, _REST * most)
    )  # fmt: skip
    for k in range(2 * SECTORS):
        sectors[k] = 0.0
    level = squares = beside = within = 0.0
    for i in range(count):
        if share[i] < 0.5 * long:
            level += wall[i]
            beside += 1.0
            continue
        dx, dy, off = lists[i] - disc[0], y[i] - disc[1], abs(rest[i])
        turn = dy / (abs(dx) + abs(dy) + 1e-12)  # sectors of equal diamond angle: no arctangent
        sector = int((1.0 + turn if dx >= 0.0 else 3.0 - turn) * (0.25 * SECTORS - 1e-6))
        sectors[sector] += 1.0
        if off <= clean:
            sectors[SECTORS + sector] += 1.0
        if share[i] > 0.999 and dx * dx + dy * dy < 0.64 * disc[2] * disc[2]:
            off = off if off < 2.0 * clean else 2.0 * clean
            squares += off * off
            within += 1.0
    clear = present = 0.0
    for k in range(SECTORS):
        if sectors[k] > 0.0:
            present += 1.0
            if sectors[SECTORS + k] > 0.7 * sectors[k]:
                clear += 1.0
    out[8] = clear / present if present > 0.0 else 0.0
    out[12] = level / beside if beside > 0.0 else math.nan
    out[13] = math.sqrt(squares / within) if within > 0.0 else math.nan


def fit(places: Any) -> None:
    """Fit the disc; out[0] stays NaN where it did not settle: singular normal equations, the centre left the patch, or the
    steps did not become small.

    numbers : cx, cy, R, s; streak; bend; string (see `gather`); noise; contrast (bob less wall, 0 if unknown).
    FREE : 6 (centre, shading, gain), 7 (and R) or 8 (and s).
    out : cx, cy, R, s, var_x, var_y, cov_xy, misfit, visible, contrast, gain, pixels, wall, misfit well inside.

    Along a streak the depth of each pixel is taken as linear in each of a few pieces, lifted by the mean of how far its
    curve is above them. The centre found is the mean of a bent streak.
    """
    numbers, lists = reals(places, NUMBERS), reals(places, ROOM)
    out, most, free = skip(numbers, OUT), places[MOST], places[FREE]
    work = skip(lists, LISTS * most)
    rise, widen, near, depth = skip(work, _RISE), skip(work, _WIDEN), skip(work, _NEAR), skip(work, _DEPTH)
    lift, before, edge, whole = skip(work, _LIFT), skip(work, _WEIGHT), skip(work, _EDGE), work
    began, aside, closer = skip(work, CHUNK), skip(work, 2 * CHUNK), skip(work, 3 * CHUNK)
    normal, right, step = skip(work, _NORMAL), skip(work, _RIGHT), skip(work, _STEP)
    disc, listed, shade = skip(work, _DISC), skip(work, _LISTED), skip(work, _SHADE)
    bx, by, noise, contrast = numbers[STREAK_X], numbers[STREAK_Y], numbers[NOISE], numbers[CONTRAST]
    qx, qy = numbers[BEND_X], numbers[BEND_Y]
    for k in range(4):
        disc[k] = numbers[CX + k]
        listed[k] = math.inf
        shade[k] = 0.0  # f0, its slopes, gain: where nothing is known, the first turn finds these alone
    disc[3] *= H_PER_SIGMA
    out[0] = math.nan
    length = math.sqrt(bx * bx + by * by)
    pieces = int(length / math.sqrt(disc[2] + 1.0)) + 1
    pieces = pieces if pieces < 16 else 16
    among = 1.0 / 12.0 + 1.0 / (6.0 * pieces * pieces)  # the mean of u² along the pieces
    first = 0 if contrast != 0.0 else 1  # the first turn on which the centre moves
    cut, clean, count, level, damp, settled = math.inf, 0.0, 0, 0.0, 1.0, False
    last_x = last_y = 0.0
    for turn in range(places[TURNS] + first):
        moved = False
        for k in range(4):
            moved = moved or not abs(disc[k] - listed[k]) < 0.75 * MARGIN
        if moved:
            count = gather(places, numbers, lists, disc)
            if count < 12:
                return
            for k in range(4):
                listed[k] = disc[k]
        if turn == 0:
            level = mean(skip(lists, _WALL * most), count)
            if first == 0:
                shade[0], shade[3] = level + contrast, 1.0
        for k in range(_DISC - _NORMAL):
            normal[k] = 0.0
        cx, cy, radius, soft = disc[0], disc[1], disc[2], disc[3]
        for begin in range(0, count, CHUNK):
            n = count - begin if count - begin < CHUNK else CHUNK
            x, y, bright = skip(lists, begin), skip(lists, _Y * most + begin), skip(lists, _BRIGHT * most + begin)
            wall, known = skip(lists, _WALL * most + begin), skip(lists, _KNOWN * most + begin)
            share, rest = skip(lists, _SHARE * most + begin), skip(lists, _REST * most + begin)
            if length < 0.05:
                cover_still(x, y, n, cx, cy, radius, soft, near, depth, share, rise, widen)
            else:
                measure_depth(x, y, n, cx, cy, radius, soft, depth, near)
                for i in range(n):
                    across = (bx * (y[i] - cy) - by * (x[i] - cx)) * near[i] / pieces
                    lift[i] = across * across * near[i] / (12.0 * soft)
                    share[i] = rise[i] = widen[i] = before[i] = edge[i] = whole[i] = aside[i] = closer[i] = 0.0
                for k in range(pieces + 1):
                    u = k / pieces - 0.5
                    bent = u * u - among
                    ax, ay = cx + u * bx + bent * qx, cy + u * by + bent * qy
                    measure_depth(x, y, n, ax, ay, radius, soft, depth, near)
                    part = 1.0 / pieces if k > 0 else 0.0
                    cover_moving(
                        depth, near, lift, n, part, soft, before, edge, whole, closer, share, rise, widen, aside
                    )
                    if k == 0:
                        for i in range(n):
                            began[i] = edge[i]
                lean(x, y, n, cx, cy, bx, by, began, edge, aside, near, depth)
            compare(x, y, n, bright, wall, known, disc, shade, cut, share, rest, work, free)
            add_up(work, rest, n, free, normal, right)
        if not invert(normal, free, step):
            return
        for a in range(free):
            step[a] = 0.0
            for b in range(free):
                step[a] += normal[_P * a + b] * right[b]
        size = math.sqrt(step[0] * step[0] + step[1] * step[1])
        longest = 0.5 * soft + 0.3 * length
        damp = 1.0 if size <= longest else longest / size
        if step[0] * last_x + step[1] * last_y < -0.5 * (last_x * last_x + last_y * last_y):
            damp *= 0.5  # to and fro over the least: a streak of another length is flat in its middle
        last_x, last_y = damp * step[0], damp * step[1]
        for k in range(4):
            shade[k] += damp * step[2 + k]
        disc[0] += damp * step[0]
        disc[1] += damp * step[1]
        still = size < STILL
        if free > 6:
            grown = damp * step[6] / radius
            disc[2] *= 1.0 + (0.2 if grown > 0.2 else -0.2 if grown < -0.2 else grown)
            still = still and abs(step[6]) < 0.02
        if free > 7:
            soft += damp * step[7]
            disc[3] = 0.8 if soft < 0.8 else 1.2 * disc[2] if soft > 1.2 * disc[2] else soft
            still = still and abs(step[7]) < 0.05
        if not (0.0 <= disc[0] <= places[COLUMNS] - 1.0 and 0.0 <= disc[1] <= places[ROWS] - 1.0):
            return
        settled = still or free == 8 or (damp == 1.0 and size < 0.3)
        clean = 0.12 * abs(shade[0] - shade[3] * level)
        clean = clean if clean > 5.0 * noise else 5.0 * noise
        sure = cut < math.inf or noise == math.inf  # where noise is not known, no pixel is left out
        if turn >= first and still and (sure or (free == 6 and largest(skip(lists, _REST * most), count) <= clean)):
            break  # at once only where what is judged below would be no better after another turn
        if turn >= first:
            cut = 0.25 * abs(shade[0] - shade[3] * level)
            cut = cut if cut > 5.0 * noise else 5.0 * noise
    look_around(lists, most, count, disc, length, clean, skip(work, _SECTORS), out)
    if not settled or right[9] < 6.0 or math.isnan(out[12]):
        return
    squares = right[8]
    for a in range(free):  # by the last step, which was not looked at again
        squares -= (2.0 - damp) * damp * step[a] * right[a]
    spare = right[9] - free
    variance = squares / (spare if spare > 1.0 else 1.0) if squares > 0.0 else 0.0
    for k in range(4):
        out[k] = disc[k]
    out[3] /= H_PER_SIGMA
    out[4], out[5], out[6] = variance * normal[0], variance * normal[_P + 1], variance * normal[1]
    out[7], out[9], out[10], out[11] = math.sqrt(variance), shade[0] - shade[3] * out[12], shade[3], count
