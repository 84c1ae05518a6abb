"""The compiled inside of the camera's shift: windows of the first frame followed to another one."""

from __future__ import annotations

import math
from typing import Any

from toolkit.motion.kernels.pointer import greys, pixels, reals, skip, wholes

# The caller's places: addresses of the picture, of the windows, of their centres, of where to start (shifts), and of the
# result (four a window: shift x and y, its uncertainty, 1 if it settled); then how many windows, pixels on their side, the
# picture's rows and columns, and bytes from one row and from one column to the next.
PICTURE, WINDOWS, POINTS, START, MOVED, COUNT, SIZE, ROWS, COLUMNS, DOWN, RIGHT = range(11)


def follow(places: Any) -> None:
    """Lucas and Kanade's steps (inverse compositional), each window on its own level."""
    size, down, right = places[SIZE], places[DOWN], places[RIGHT]
    half = size // 2
    for k in range(places[COUNT]):
        window = skip(pixels(places, WINDOWS), k * size * size)
        point, start = skip(wholes(places, POINTS), 2 * k), skip(reals(places, START), 2 * k)
        moved = skip(reals(places, MOVED), 4 * k)
        moved[3] = 0.0
        n00 = n01 = n11 = g0 = g1 = 0.0
        for v in range(1, size - 1):
            for u in range(1, size - 1):
                at = v * size + u
                gx, gy = 0.5 * (window[at + 1] - window[at - 1]), 0.5 * (window[at + size] - window[at - size])
                n00 += gx * gx
                n01 += gx * gy
                n11 += gy * gy
                g0 += gx
                g1 += gy
        determinant = n00 * n11 - n01 * n01
        if not determinant > 1e-6 * n00 * n11:
            continue
        sx, sy = start[0], start[1]
        count = (size - 2) * (size - 2)
        for _ in range(12):
            x0, y0 = point[0] - half + sx, point[1] - half + sy
            ix, iy = math.floor(x0), math.floor(y0)
            if ix < 0 or iy < 0 or ix + size + 1 >= places[COLUMNS] or iy + size + 1 >= places[ROWS]:
                break
            fx, fy = x0 - ix, y0 - iy
            level = r0 = r1 = squares = 0.0
            for v in range(1, size - 1):
                upper = skip(greys(places, PICTURE), (iy + v) * down + ix * right)
                lower = skip(upper, down)
                for u in range(1, size - 1):
                    top = upper[u * right] * (1.0 - fx) + upper[(u + 1) * right] * fx
                    bottom = lower[u * right] * (1.0 - fx) + lower[(u + 1) * right] * fx
                    at = v * size + u
                    rest = top * (1.0 - fy) + bottom * fy - window[at]
                    r0 += 0.5 * (window[at + 1] - window[at - 1]) * rest
                    r1 += 0.5 * (window[at + size] - window[at - size]) * rest
                    level += rest
                    squares += rest * rest
            level /= count
            r0 -= level * g0
            r1 -= level * g1
            dx = -(r0 * n11 - r1 * n01) / determinant
            dy = -(r1 * n00 - r0 * n01) / determinant
            sx += 3.0 if dx > 3.0 else -3.0 if dx < -3.0 else dx
            sy += 3.0 if dy > 3.0 else -3.0 if dy < -3.0 else dy
            if abs(dx) < 0.01 and abs(dy) < 0.01:
                moved[0], moved[1] = sx, sy
                moved[2] = math.sqrt((squares - count * level * level) / count * (n00 + n11) / determinant)
                moved[3] = 1.0
                break
