"""The compiled inside of the background: a running mean of the pixels that neither bob nor string hides."""

from __future__ import annotations

import math
from typing import Any

from toolkit.motion.kernels.pointer import pixels, reals, skip

# The caller's places: addresses of the piece, of the mean and the counts from the piece's first pixel on, and of the
# numbers (the bob's place in the piece, its radius, the string's direction or zeros, the light's factor, the most that a
# count grows to); then the piece's rows and columns, and elements from one row to the next of each picture.
PIECE, MEAN, SEEN, NUMBERS, ROWS, COLUMNS, PIECE_ROW, BACK_ROW = range(8)


def add(places: Any) -> None:
    """Take the piece in."""
    numbers = reals(places, NUMBERS)
    bx, by, radius, ux, uy = numbers[0], numbers[1], numbers[2], numbers[3], numbers[4]
    factor, most = numbers[5], numbers[6]
    string = math.fabs(ux) + math.fabs(uy) > 0.0
    for y in range(places[ROWS]):
        new = skip(pixels(places, PIECE), y * places[PIECE_ROW])
        mean, seen = (
            skip(pixels(places, MEAN), y * places[BACK_ROW]),
            skip(pixels(places, SEEN), y * places[BACK_ROW]),
        )
        dy = y - by
        for x in range(places[COLUMNS]):  # without a branch, so that several pixels are done at once
            dx = x - bx
            along = dx * ux + dy * uy
            beside = 2.0 * radius - along
            wide = 4.0 + 0.25 * (beside if beside > 0.0 else 0.0)
            hidden = (dx * dx + dy * dy < radius * radius) | (string & (along > 0.0) & (abs(dx * uy - dy * ux) < wide))
            n = seen[x] + 1.0
            n = n if n < most else most
            mean[x] += 0.0 if hidden else (new[x] * factor - mean[x]) / n
            seen[x] = seen[x] if hidden else n
