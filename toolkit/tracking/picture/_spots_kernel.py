"""The compiled inside of the looks at a few spots; they are given as offsets from a place, in units of a reach."""

from __future__ import annotations

import math
from typing import Any

from toolkit.motion.kernels.pointer import greys, pixels, reals
from toolkit.tracking._sine import part

# The caller's places: addresses of the picture (float32), of the offsets (all x, then all y), of the numbers (x, y, reach, the
# bob's shade, the light, how much a spot must show of the bob to tell, where the picture's first pixel lies in the still one, and
# the streak) and of the result (whether each spot lies in both pictures or in neither, of how many spots there are that nothing
# stands before, of how many could be told, of how many are the bob's); then how many offsets there are, the picture's rows and
# columns, and elements from one row to the next; of the still picture (float32) and of what stands before it (bytes, or 0) the
# addresses, rows, and columns, which lie side by side.
PICTURE, OFFSETS, NUMBERS, RESULT, COUNT, ROWS, COLUMNS, DOWN, STILL, FRONT, STILL_ROWS, STILL_COLUMNS = range(12)


@part
def pixel(offset: float, reach: float, at: float) -> int:
    """The row or column of a spot."""
    return math.floor(reach * offset + at + 0.5)


@part
def share(right: float, down: float, reach: float, streak_x: float, streak_y: float) -> float:
    """For what part of the exposure a spot is within the disc, whose middle goes evenly along the streak."""
    length = math.sqrt(streak_x * streak_x + streak_y * streak_y)
    if length < 1e-3:
        return 1.0
    along, across = (right * streak_x + down * streak_y) / length, (right * streak_y - down * streak_x) / length
    half = math.sqrt(max(reach * reach - across * across, 0.0))
    return max(min(0.5, (along + half) / length) - max(-0.5, (along - half) / length), 0.0)


def told(places: Any) -> None:
    """On how many spots the picture shows the bob, and not what stands still there."""
    count, numbers, offsets, result = (
        places[COUNT], reals(places, NUMBERS), reals(places, OFFSETS), reals(places, RESULT)
    )  # fmt: skip
    picture, still, front = pixels(places, PICTURE), pixels(places, STILL), greys(places, FRONT)
    at_x, at_y, reach, shade, light, least = numbers[0], numbers[1], numbers[2], numbers[3], numbers[4], numbers[5]
    whole = True
    seen = tells = bobs = 0
    for i in range(count):
        x, y = pixel(offsets[i], reach, at_x), pixel(offsets[count + i], reach, at_y)
        u, v = pixel(offsets[i], reach, at_x + numbers[6]), pixel(offsets[count + i], reach, at_y + numbers[7])
        within = 0 <= x < places[COLUMNS] and 0 <= y < places[ROWS]
        behind = 0 <= u < places[STILL_COLUMNS] and 0 <= v < places[STILL_ROWS]
        whole = whole and within == behind
        if within and behind and (places[FRONT] == 0 or front[v * places[STILL_COLUMNS] + u] == 0):
            shown, without = picture[y * places[DOWN] + x] / light, still[v * places[STILL_COLUMNS] + u]
            part_of = share(reach * offsets[i], reach * offsets[count + i], reach, numbers[8], numbers[9])
            smeared = without + part_of * (shade - without)
            seen += 1
            if abs(smeared - without) > least:
                tells += 1
                bobs += abs(shown - smeared) < abs(shown - without)
    result[0], result[1], result[2], result[3] = whole, seen, tells, bobs
