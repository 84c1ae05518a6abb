"""The compiled inside of a camera's view: where it shows what, and what its lens does; formulas as in `view`."""

from __future__ import annotations

import math
from typing import Any

from toolkit.motion.kernels.pointer import reals, skip
from toolkit.tracking._sine import cosine, part, sine

# The caller's places: addresses of the sets of parameters (each in the order of `view.NAMES`), of the picture's middle, and of
# lists of COUNT numbers a SET, first those given, then those found; then the numbers of sets and points.
VALUES, MIDDLE, LISTS, SETS, COUNT = range(5)
_NAMES = 19


@part
def grown(k1: float, far: float) -> float:
    """By how much the lens takes a place away from the middle that is seen so far from it (squared, over the corner's)."""
    far = far if far < 4.0 else 4.0
    grow = 1.0
    for _ in range(6):
        grow = 1.0 + k1 * far / (grow * grow)
    return grow


def see(places: Any) -> None:
    """Where the picture shows (x, y) a bob that is at an angle at a time."""
    count, middle = places[COUNT], reals(places, MIDDLE)
    mx, my = middle[0], middle[1]
    corner, wide = mx * mx + my * my, 2.0 * (mx if mx > my else my)
    for k in range(places[SETS]):
        v, theta = skip(reals(places, VALUES), k * _NAMES), skip(reals(places, LISTS), k * count)
        t, x = skip(theta, places[SETS] * count), skip(theta, 2 * places[SETS] * count)
        y = skip(theta, 3 * places[SETS] * count)
        pivot_x, pivot_y, length, vertical, k1 = v[0] - mx, v[1] - my, v[2], v[3], v[13]
        omega, by_sine, by_cosine = math.sqrt(abs(v[4])), v[14], v[15]
        sy, cy, sp, cp = math.sin(v[10]), math.cos(v[10]), math.sin(v[11]), math.cos(v[11])
        nearness = math.exp(v[12] if v[12] < 1.5 else 1.5) / wide
        off_x, off_y = mx + v[17], my + v[18]
        for i in range(count):
            phase = omega * t[i]
            sway = by_sine * sine(phase) + by_cosine * cosine(phase)
            in_plane = length * cosine(sway)
            right, down, away = (
                in_plane * sine(theta[i] + vertical), in_plane * cosine(theta[i] + vertical), length * sine(sway)
            )  # fmt: skip
            right, away = cy * right - sy * away, sy * right + cy * away
            down, away = cp * down + sp * away, cp * away - sp * down
            near = 1.0 + nearness * away
            near = near if near > 0.05 else 0.05
            dx, dy = (pivot_x + right) / near, (pivot_y + down) / near
            far = (dx * dx + dy * dy) / corner
            grow = 1.0 + k1 * (far if far < 4.0 else 4.0)
            x[i] = off_x + dx * grow
            y[i] = off_y + dy * grow


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


def miss(places: Any) -> None:
    """How far the line through two places passes the pivot, over its uncertainty there; given besides: by how much the second
    is turned about the pivot, over factor and readout, and the σ of the line's direction and place."""
    count, middle = places[COUNT], reals(places, MIDDLE)
    mx, my, stride = middle[0], middle[1], places[SETS] * count
    corner = mx * mx + my * my
    for k in range(places[SETS]):
        v, above_x = skip(reals(places, VALUES), k * _NAMES), skip(reals(places, LISTS), k * count)
        above_y, below_x, below_y = skip(above_x, stride), skip(above_x, 2 * stride), skip(above_x, 3 * stride)
        turned, sigma_rad, sigma_px = skip(above_x, 4 * stride), skip(above_x, 5 * stride), skip(above_x, 6 * stride)
        found = skip(above_x, 7 * stride)
        x, y, turn, k1 = v[0] - mx, v[1] - my, v[9] * v[16], v[13]
        for i in range(count):
            ax, ay, bx, by = above_x[i] - mx, above_y[i] - my, below_x[i] - mx, below_y[i] - my
            grow_a, grow_b = grown(k1, (ax * ax + ay * ay) / corner), grown(k1, (bx * bx + by * by) / corner)
            ax, ay = ax / grow_a, ay / grow_a
            dx, dy, back = bx / grow_b - x, by / grow_b - y, turn * turned[i]
            bx, by = x + dx - back * dy, y + dy + back * dx
            dx, dy = bx - ax, by - ay
            off_x, off_y = x - 0.5 * (ax + bx), y - 0.5 * (ay + by)
            square = sigma_rad[i] * sigma_rad[i] * (off_x * off_x + off_y * off_y) + sigma_px[i] * sigma_px[i] + 1e-6
            found[i] = (dy * (x - ax) - dx * (y - ay)) / math.sqrt((dx * dx + dy * dy) * square)
