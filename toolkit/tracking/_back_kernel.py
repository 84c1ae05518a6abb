"""The compiled inside of the background: a running mean of the pixels that neither bob nor string hides."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from toolkit.motion.kernels.pointer import greys, pixels, reals, skip, wholes

# The caller's places of `add`: addresses of the piece, of the mean and the counts from the piece's first pixel on, and of the
# numbers (the bob's place in the piece, its radius, the string's direction or zeros, the light's factor, the most that a
# count grows to); then the piece's rows and columns, and elements from one row to the next of each picture.
PIECE, MEAN, SEEN, NUMBERS, ROWS, COLUMNS, PIECE_ROW, BACK_ROW = range(8)
# Those of `add_all`: addresses of the list of pictures (of each: its address, bytes from one row to the next, what is to be
# added to row and column of the background, and the part x0, y0, x1, y1 of the background that it shows), of the mean, the
# counts, the numbers (as above for each picture, but the bob's place in the background) and of room for a row; then how many
# pictures there are, the background's first row and the one after the last, and elements from one of its rows to the next.
PICTURES, WHOLE, COUNTS, EACH, ROOM, COUNT, TOP, BOTTOM, DOWN = range(9)
_PICTURE = 8  # numbers of each picture


@njit(inline="always")
def take(new: Any, mean: Any, seen: Any, columns: int, first: int, y: float, numbers: Any) -> None:
    """Take in a row whose first pixel lies at `first`, y; in single precision, of which the processor does twice as many at
    once, and without a branch."""
    single = np.float32
    radius, ux, uy = single(numbers[2]), single(numbers[3]), single(numbers[4])
    factor, most = single(numbers[5]), single(numbers[6])
    none, one, wider, narrowest = single(0.0), single(1.0), single(0.25), single(4.0)
    start = none if abs(ux) + abs(uy) > none else single(math.inf)  # of the string, along it
    left, dy = single(first - numbers[0]), single(y - numbers[1])
    for x in range(columns):
        dx = single(np.int32(x)) + left
        along = dx * ux + dy * uy
        beside = radius + radius - along
        wide = narrowest + wider * (beside if beside > none else none)
        hidden = (dx * dx + dy * dy < radius * radius) | ((along > start) & (abs(dx * uy - dy * ux) < wide))
        n = seen[x] + one
        n = n if n < most else most
        mean[x] += none if hidden else (new[x] * factor - mean[x]) / n
        seen[x] = seen[x] if hidden else n


def add(places: Any) -> None:
    """Take the piece in."""
    for y in range(places[ROWS]):
        new = skip(pixels(places, PIECE), y * places[PIECE_ROW])
        mean = skip(pixels(places, MEAN), y * places[BACK_ROW])
        seen = skip(pixels(places, SEEN), y * places[BACK_ROW])
        take(new, mean, seen, places[COLUMNS], 0, y, reals(places, NUMBERS))


def add_all(places: Any) -> None:
    """Take all pictures in, row by row: one of the background stays in the processor's nearest memory."""
    row = pixels(places, ROOM)
    for y in range(places[TOP], places[BOTTOM]):
        for k in range(places[COUNT]):
            picture = skip(wholes(places, PICTURES), _PICTURE * k)
            x0, x1 = picture[4], picture[6]
            if y < picture[5] or y >= picture[7]:
                continue
            line = skip(greys(picture, 0), (y + picture[2]) * picture[1] + x0 + picture[3])
            for x in range(x1 - x0):
                row[x] = np.float32(line[x])
            mean = skip(pixels(places, WHOLE), y * places[DOWN] + x0)
            seen = skip(pixels(places, COUNTS), y * places[DOWN] + x0)
            take(row, mean, seen, x1 - x0, x0, y, skip(reals(places, EACH), 7 * k))
