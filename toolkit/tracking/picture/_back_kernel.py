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
# added to column and row of the background, and the part x0, y0, x1, y1 of the background that it shows), of the mean, the
# counts, the numbers (as above for each picture, but the bob's place in the background) and of room for two rows; then how many
# pictures there are, the part x0, y0, x1, y1 of the background, and elements from one of its rows to the next.
PICTURES, WHOLE, COUNTS, EACH, ROOM, COUNT, LEFT, TOP, RIGHT, BOTTOM, DOWN = range(11)
_PICTURE = 8  # numbers of each picture


@njit(inline="always")
def hides(dx: float, dy: float, radius: float, ux: float, uy: float, start: float) -> bool:
    """Is what lies so far from the bob hidden by it or, beyond `start`, by the string? In single precision, of which the
    processor does twice as many at once, and without a branch."""
    along = dx * ux + dy * uy
    beside = radius + radius - along
    wide = np.float32(4.0) + np.float32(0.25) * (beside if beside > np.float32(0.0) else np.float32(0.0))
    hidden = (dx * dx + dy * dy < radius * radius) | ((along > start) & (abs(dx * uy - dy * ux) < wide))
    return bool(hidden)


@njit(inline="always")
def beginning(numbers: Any) -> float:
    """Where along its direction the string begins: nowhere, if there is none."""
    return 0.0 if abs(numbers[3]) + abs(numbers[4]) > 0.0 else math.inf


def add(places: Any) -> None:
    """Take the piece in."""
    numbers, single = reals(places, NUMBERS), np.float32
    radius, ux, uy, start = single(numbers[2]), single(numbers[3]), single(numbers[4]), single(beginning(numbers))
    factor, most, left = single(numbers[5]), single(numbers[6]), single(-numbers[0])
    for y in range(places[ROWS]):
        new = skip(pixels(places, PIECE), y * places[PIECE_ROW])
        mean = skip(pixels(places, MEAN), y * places[BACK_ROW])
        seen = skip(pixels(places, SEEN), y * places[BACK_ROW])
        dy = single(y - numbers[1])
        for x in range(places[COLUMNS]):
            hidden = hides(single(np.int32(x)) + left, dy, radius, ux, uy, start)
            n = seen[x] + single(1.0)
            n = n if n < most else most
            mean[x] += single(0.0) if hidden else (new[x] * factor - mean[x]) / n
            seen[x] = seen[x] if hidden else n


def add_all(places: Any) -> None:
    """Take all pictures in, row by row: one of the background stays in the processor's nearest memory."""
    single = np.float32
    left, columns = places[LEFT], places[RIGHT] - places[LEFT]
    total, times = pixels(places, ROOM), skip(pixels(places, ROOM), columns)
    for y in range(places[TOP], places[BOTTOM]):
        for x in range(columns):
            total[x] = times[x] = single(0.0)
        for k in range(places[COUNT]):
            picture, numbers = skip(wholes(places, PICTURES), _PICTURE * k), skip(reals(places, EACH), 7 * k)
            x0, x1 = picture[4], picture[6]
            if y < picture[5] or y >= picture[7]:
                continue
            line = skip(greys(picture, 0), (y + picture[3]) * picture[1] + x0 + picture[2])
            sums, counts = skip(total, x0 - left), skip(times, x0 - left)
            radius, ux, uy, start = (
                single(numbers[2]),
                single(numbers[3]),
                single(numbers[4]),
                single(beginning(numbers)),
            )
            first, dy = single(x0 - numbers[0]), single(y - numbers[1])
            for x in range(x1 - x0):
                hidden = hides(single(np.int32(x)) + first, dy, radius, ux, uy, start)
                sums[x] += single(0.0) if hidden else single(line[x])
                counts[x] += single(0.0) if hidden else single(1.0)
        mean = skip(pixels(places, WHOLE), y * places[DOWN] + left)
        seen = skip(pixels(places, COUNTS), y * places[DOWN] + left)
        for x in range(columns):
            n = seen[x] + times[x]
            mean[x] += (total[x] - times[x] * mean[x]) / (n if n > single(0.0) else single(1.0))
            seen[x] = n
