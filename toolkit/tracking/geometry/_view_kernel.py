"""The compiled inside of a camera's view: where it shows what, and what its lens does; formulas as in `view`."""

from __future__ import annotations

import math
from typing import Any

from toolkit.motion.kernels.pointer import call_kernel, reals, skip, wholes
from toolkit.tracking._sine import cosine, part, sine
from toolkit.tracking.geometry._swing_kernel import MOTIONS, TIMES

# The caller's places for `see` and `straight`: addresses of the sets of parameters (each in the order of `view.NAMES`), of the
# picture's middle, and of lists of COUNT numbers a SET, first those given, then those found; then the numbers of sets and points.
VALUES, MIDDLE, LISTS, SETS, COUNT = range(5)
# For `rest`: addresses of the sets, of the picture's middle and by how much all data weigh less, of the lists of what was
# measured (six numbers a place, nine a line, three a value tied), of the number of each set's motion (the first with a number
# brings it), of each place's and line's number in the order of time, of room to work in, and of the residuals; then how many
# sets there are, places, lines and values tied; the address of the swing's kernel and of its places, with room for as many
# motions as are wanted, at times those of the places or of the lines too.
NUMBERS, GIVEN, MOTION, ORDER, ROOM, FOUND, MANY, PLACES, LINES, TIED, SWING, ITS = range(1, 13)
_NAMES = 19


@part
def grown(k1: float, far: float) -> float:
    """By how much the lens takes a place away from the middle that is seen so far from it (squared, over the corner's)."""
    far = far if far < 4.0 else 4.0
    grow = 1.0
    for _ in range(6):
        grow = 1.0 + k1 * far / (grow * grow)
    return grow


@part
def camera(v: Any, mx: float, my: float) -> Any:
    """What `shown` needs of a set of parameters."""
    wide = 2.0 * (mx if mx > my else my)
    nearness = math.exp(v[12] if v[12] < 1.5 else 1.5) / wide
    turn = math.sin(v[10]), math.cos(v[10]), math.sin(v[11]), math.cos(v[11])
    sway = math.sqrt(abs(v[4])), v[14], v[15]
    bob = v[0] - mx, v[1] - my, v[2], v[3]
    return bob, sway, turn, (nearness, v[13], mx * mx + my * my, mx + v[17], my + v[18])


@part
def shown(seen_by: Any, theta: float, t: float) -> tuple[float, float]:
    """Where the picture shows a bob that is at an angle at a time."""
    (pivot_x, pivot_y, length, vertical), (omega, by_sine, by_cosine), (sy, cy, sp, cp), lens = seen_by
    nearness, k1, corner, off_x, off_y = lens
    phase = omega * t
    sway = by_sine * sine(phase) + by_cosine * cosine(phase)
    in_plane = length * cosine(sway)
    right, down, away = in_plane * sine(theta + vertical), in_plane * cosine(theta + vertical), length * sine(sway)
    right, away = cy * right - sy * away, sy * right + cy * away
    down, away = cp * down + sp * away, cp * away - sp * down
    near = 1.0 + nearness * away
    near = near if near > 0.05 else 0.05
    dx, dy = (pivot_x + right) / near, (pivot_y + down) / near
    far = (dx * dx + dy * dy) / corner
    grow = 1.0 + k1 * (far if far < 4.0 else 4.0)
    return off_x + dx * grow, off_y + dy * grow


@part
def missed(
    v: Any, mx: float, my: float, ax: float, ay: float, bx: float, by: float, back: float, rad: float, px: float
) -> float:
    """How far the line through two places passes the pivot, over its uncertainty there (by `rad`, px, of direction and place);
    the second is turned `back` about the pivot."""
    x, y, k1, corner = v[0] - mx, v[1] - my, v[13], mx * mx + my * my
    ax, ay, bx, by = ax - mx, ay - my, bx - mx, by - my
    grow_a, grow_b = grown(k1, (ax * ax + ay * ay) / corner), grown(k1, (bx * bx + by * by) / corner)
    ax, ay = ax / grow_a, ay / grow_a
    dx, dy = bx / grow_b - x, by / grow_b - y
    bx, by = x + dx - back * dy, y + dy + back * dx
    dx, dy = bx - ax, by - ay
    off_x, off_y = x - 0.5 * (ax + bx), y - 0.5 * (ay + by)
    square = rad * rad * (off_x * off_x + off_y * off_y) + px * px + 1e-6
    return (dy * (x - ax) - dx * (y - ay)) / math.sqrt((dx * dx + dy * dy) * square)


def see(places: Any) -> None:
    """Where the picture shows (x, y) a bob that is at an angle at a time."""
    count, middle = places[COUNT], reals(places, MIDDLE)
    for k in range(places[SETS]):
        seen_by = camera(skip(reals(places, VALUES), k * _NAMES), middle[0], middle[1])
        theta = skip(reals(places, LISTS), k * count)
        t, x = skip(theta, places[SETS] * count), skip(theta, 2 * places[SETS] * count)
        y = skip(theta, 3 * places[SETS] * count)
        for i in range(count):
            x[i], y[i] = shown(seen_by, theta[i], t[i])


def straight(places: Any) -> None:
    """Where a lens that does not bend would show (x, y) what is seen at a place."""
    count, middle = places[COUNT], reals(places, MIDDLE)
    mx, my = middle[0], middle[1]
    corner = mx * mx + my * my
    for k in range(places[SETS]):
        k1, seen_x = reals(places, VALUES)[k * _NAMES + 13], skip(reals(places, LISTS), k * count)
        seen_y, x = skip(seen_x, places[SETS] * count), skip(seen_x, 2 * places[SETS] * count)
        y = skip(seen_x, 3 * places[SETS] * count)
        for i in range(count):
            dx, dy = seen_x[i] - mx, seen_y[i] - my
            grow = grown(k1, (dx * dx + dy * dy) / corner)
            x[i] = mx + dx / grow
            y[i] = my + dy / grow


def rest(places: Any) -> None:
    """The residuals of each set: places (x, then y), lines, values tied, over their uncertainties."""
    count, lines, tied, swing = places[PLACES], places[LINES], places[TIED], wholes(places, ITS)
    numbers, order, number = reals(places, NUMBERS), wholes(places, ORDER), wholes(places, MOTION)
    mx, my, strength = numbers[0], numbers[1], 1.0 / numbers[2]
    t, row, seen_x = reals(places, GIVEN), skip(reals(places, GIVEN), count), skip(reals(places, GIVEN), 2 * count)
    seen_y, by_x, by_y = skip(seen_x, count), skip(seen_x, 2 * count), skip(seen_x, 3 * count)
    ax = skip(t, 6 * count)
    ay, bx, by, rad = skip(ax, lines), skip(ax, 2 * lines), skip(ax, 3 * lines), skip(ax, 4 * lines)
    px, later, when, weight = skip(ax, 5 * lines), skip(ax, 6 * lines), skip(ax, 7 * lines), skip(ax, 8 * lines)
    which = skip(ax, 9 * lines)
    centre, width = skip(which, tied), skip(which, 2 * tied)
    angle, now, turned = reals(places, ROOM), skip(reals(places, ROOM), count), skip(reals(places, ROOM), 2 * count)
    motions, times, own = reals(swing, MOTIONS), swing[TIMES], 0
    size = 9 + 3 * times
    for k in range(places[MANY]):
        if number[k] == own:
            v, motion = skip(reals(places, VALUES), k * _NAMES), skip(motions, own * size)
            for i in range(7):
                motion[i] = v[i]
            motion[7], motion[8] = v[7] / v[9], v[8] / v[9]
            for i in range(count):
                motion[9 + order[i]] = t[i] + v[16] * row[i]
            for i in range(count, times):
                motion[9 + order[i]] = when[i - count]
            own += 1
    call_kernel(places[SWING], swing)
    for k in range(places[MANY]):
        v, found = skip(reals(places, VALUES), k * _NAMES), skip(reals(places, FOUND), k * (2 * count + lines + tied))
        theta, seen_by = skip(motions, number[k] * size + 9 + times), camera(v, mx, my)
        for i in range(count):
            angle[i], now[i] = v[9] * theta[order[i]], t[i] + v[16] * row[i]
        for i in range(lines):
            turned[i] = v[9] * v[16] * later[i] * theta[times + order[count + i]] if times > count else 0.0
        # in place, and few lists at a time: only then does the compiler know that they are apart, and does several at once
        for i in range(count):
            angle[i], now[i] = shown(seen_by, angle[i], now[i])
        for i in range(lines):
            turned[i] = missed(v, mx, my, ax[i], ay[i], bx[i], by[i], turned[i], rad[i], px[i])
        for i in range(count):
            found[i] = (angle[i] - seen_x[i]) * by_x[i] * strength
        for i in range(count):
            found[count + i] = (now[i] - seen_y[i]) * by_y[i] * strength
        for i in range(lines):
            found[2 * count + i] = turned[i] * weight[i] * strength
        for i in range(tied):
            found[2 * count + lines + i] = (v[int(which[i])] - centre[i]) / width[i]
