"""The compiled inside of making a picture smaller: averages over squares."""

from __future__ import annotations

from typing import Any

import numpy as np

from toolkit.motion.kernels.pointer import greys, pixels, skip

# The caller's places:: addresses of the picture, of the small one and of room for one row; then rows and columns of
# the small one, how many pixels are averaged each way, and bytes from one row of the picture to the next.
PICTURE, SMALL, ROOM, ROWS, COLUMNS, FACTOR, DOWN = range(7)


def shrink(places: Any) -> None:
    """The mean of each square, rounded to a whole number; in plain loops, of which the compiler makes vector instructions."""
    row, factor, columns = pixels(places, ROOM), places[FACTOR], places[COLUMNS]
    part = np.float32(1.0 / (factor * factor))
    for v in range(places[ROWS]):
        for x in range(columns * factor):
            row[x] = np.float32(0.0)
        for k in range(factor):
            line = skip(greys(places, PICTURE), (v * factor + k) * places[DOWN])
            for x in range(columns * factor):
                row[x] += np.float32(line[x])
        small = skip(pixels(places, SMALL), v * columns)
        for u in range(columns):
            small[u] = np.float32(0.0)
        for k in range(factor):
            for u in range(columns):
                small[u] += row[u * factor + k]
        for u in range(columns):
            small[u] = np.float32(np.int32(small[u] * part + np.float32(0.5)))
