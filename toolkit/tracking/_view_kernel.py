"""The compiled inside of a camera's view: where it shows what, and what its lens does; formulas as in `view`."""

from __future__ import annotations

import math
from typing import Any

from toolkit.motion.kernels.pointer import reals, skip
from toolkit.tracking._sine import cosine, sine

# The caller's places: addresses of the sets of parameters (each in the order of `view.NAMES`), of the picture's middle, and of
# four lists of COUNT numbers a SET: two that are given, two that are found; then the numbers of sets and points.
VALUES, MIDDLE, LISTS, SETS, COUNT = range(5)
_NAMES = 19


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
            far = (dx * dx + dy * dy) / corner
            far = far if far < 4.0 else 4.0
            grow = 1.0
            for _ in range(6):
                grow = 1.0 + k1 * far / (grow * grow)
            x[i] = mx + dx / grow
            y[i] = my + dy / grow
