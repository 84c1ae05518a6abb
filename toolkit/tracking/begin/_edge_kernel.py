"""The compiled inside of the search: the edges that move in a picture."""

from __future__ import annotations

import math
from typing import Any

from toolkit.motion.kernels.pointer import pixels, reals, skip, wholes

# The caller's places: addresses of the picture, of the pixels looked at (row times columns plus column), of the least slope, of
# the result (five lists: column, row, direction of the slope x and y, slope) and of how many there are; then how many pixels
# are looked at, and rows and columns of the picture.
PLANE, WHERE, LEAST, EDGES, FOUND, COUNT, HEIGHT, WIDTH = range(8)


def edges(places: Any) -> None:
    """The pixels at which the picture's slope (Sobel) is more than the least."""
    picture, where, out = pixels(places, PLANE), wholes(places, WHERE), reals(places, EDGES)
    columns, most, least, n = places[WIDTH], places[COUNT], reals(places, LEAST)[0], 0
    rows, nx, ny, slope = skip(out, most), skip(out, 2 * most), skip(out, 3 * most), skip(out, 4 * most)
    for i in range(most):
        at = where[i]
        v = at // columns
        u = at - v * columns
        west, east = (-1 if u > 0 else 1), (1 if u < columns - 1 else -1)  # mirrored at the rim
        above = skip(picture, at + (-columns if v > 0 else columns))
        below = skip(picture, at + (columns if v < places[HEIGHT] - 1 else -columns))
        here = skip(picture, at)
        gx = 0.125 * (above[east] - above[west] + 2.0 * (here[east] - here[west]) + below[east] - below[west])
        gy = 0.125 * (below[west] - above[west] + 2.0 * (below[0] - above[0]) + below[east] - above[east])
        size = math.sqrt(gx * gx + gy * gy)
        if size > least:
            out[n], rows[n], nx[n], ny[n], slope[n] = u, v, gx / size, gy / size, size
            n += 1
    wholes(places, FOUND)[0] = n
