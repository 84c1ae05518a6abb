"""The compiled inside of the string's measurement: a ridge refined section by section across it."""

from __future__ import annotations

import math
from typing import Any

from toolkit.motion.kernels.pointer import greys, reals, skip
from toolkit.tracking._sine import part

# The caller's places: addresses of the picture and of the numbers (bob x and y, pivot x and y, radius, how far from the bob
# to start, the slope against the pivot's direction if it is known, else NaN), then of the result and of room to work in; then the picture's rows and columns, and bytes from one row and
# from one column to the next.
# result : 1 if a string was found; a point on it, its direction from bob to pivot (x, y), the uncertainties of direction
# and place, the ridge's height over its own uncertainty, the slope against the pivot's direction.
PICTURE, NUMBERS, RESULT, ROOM, ROWS, COLUMNS, DOWN, RIGHT = range(8)
STRIPS, STRIP, SLOPES = 24, 65, 26  # sections and their pixels for the first look; slopes tried to either side
SECTIONS, HALF, ENDS = 100, 5, 8  # sections at most; pixels to either side that the ridge, and its section, reach
WIDTH2 = 1.5 * 1.5  # the ridge's variance, px²
_WIDE = 2 * HALF + 1
NEAR, STILL = 0.1, 0.03  # px: a step so short ends the look at a piece, and at the whole
DIGITS = 20  # of a place's fraction
FINE = 2**DIGITS
SPARE = max(STRIPS * STRIP, SECTIONS * _WIDE) + 2 * _WIDE + 2 * ENDS


@part
def brightness(picture: Any, down: int, right: int, x: int, y: int) -> float:
    """The picture between its pixels, at a place in units of 1/FINE px: in whole numbers it is quicker to find."""
    at = skip(picture, (y >> DIGITS) * down + (x >> DIGITS) * right)
    fx, fy = x & (FINE - 1), y & (FINE - 1)
    first, second, third, fourth = int(at[0]), int(at[right]), int(at[down]), int(at[down + right])
    top, bottom = first * FINE + (second - first) * fx, third * FINE + (fourth - third) * fx
    return (top * FINE + (bottom - top) * fy) * (1.0 / (FINE * FINE))


@part
def clearest(places: Any, strips: Any, bx: float, by: float, ux: float, uy: float, start: float, far: float) -> float:
    """The slope against the pivot's direction at which the line from the bob is most unlike both its sides; 0 unless it is
    clearer by far than what lies straight ahead."""
    middle, picture, down, right = STRIP // 2, greys(places, PICTURE), places[DOWN], places[RIGHT]
    step_x, step_y = int(ux * FINE), int(uy * FINE)
    last_x, last_y = (places[COLUMNS] - 1) * FINE, (places[ROWS] - 1) * FINE
    for k in range(STRIPS):
        along = start + (k + 0.5) * (far - start) / STRIPS
        x, y = int((bx + ux * along + uy * middle) * FINE), int((by + uy * along - ux * middle) * FINE)
        for j in range(STRIP):
            inside = x >= 0 and y >= 0 and x < last_x and y < last_y
            strips[k * STRIP + j] = brightness(picture, down, right, x, y) if inside else math.nan
            x -= step_y
            y += step_x
    plain = best = slope = 0.0
    for i in range(-SLOPES, SLOPES + 1):
        sum1 = sum2 = 0.0
        seen = 0
        for k in range(STRIPS):
            along = start + (k + 0.5) * (far - start) / STRIPS
            at = k * STRIP + math.floor(i * along / far + 0.5) + middle
            g = strips[at] - 0.5 * (strips[at - 5] + strips[at + 5])
            if g == g:
                sum1 += g
                sum2 += g * g
                seen += 1
        if seen >= STRIPS // 2:
            clear = abs(sum1) / math.sqrt(seen * (sum2 - sum1 * sum1 / seen) + 4.0 * seen * seen)
            if -4 <= i <= 4 and clear > plain:
                plain = clear
            if clear > best:
                best, slope = clear, i / far
    return slope if best > 1.5 * plain else 0.0


def ridge(places: Any) -> None:
    """Fit the line, first on the piece near the bob, then on longer ones; where its slope is known on the whole at once."""
    numbers, result, rest_of = reals(places, NUMBERS), reals(places, RESULT), reals(places, ROOM)
    shape = skip(rest_of, SPARE - 2 * _WIDE - 2 * ENDS)  # of the ridge
    profile = skip(shape, _WIDE)
    picture, down, right = greys(places, PICTURE), places[DOWN], places[RIGHT]
    bx, by, radius, start = numbers[0], numbers[1], numbers[4], numbers[5]
    ux, uy = numbers[2] - bx, numbers[3] - by
    length = math.sqrt(ux * ux + uy * uy)
    result[0] = 0.0
    if not length >= 2.0 * radius + 20.0:
        return
    ux, uy = ux / length, uy / length
    step_x, step_y = int(ux * FINE), int(uy * FINE)
    square = 0.0
    for j in range(_WIDE):
        shape[j] = math.exp(-(j - HALF) * (j - HALF) / (2.0 * WIDTH2))
        square += shape[j] * shape[j]
    far = length - 4.0
    a, middle = 0.0, 0.0  # the line: across = a + b (along − middle)
    b, first = numbers[6], 2
    if b != b:
        b, first = clearest(places, rest_of, bx, by, ux, uy, start, start + 60.0 if start + 60.0 < far else far), 0
    height = strength = noise = n00 = n01 = n11 = 0.0
    for stage in range(first, 3):
        least = STILL if stage == 2 else NEAR
        end = start + (60.0 if stage == 0 else 200.0 if stage == 1 else length)
        end = end if end < far else far
        if end - start < 15.0:
            return
        a += b * (0.5 * (start + end) - middle)
        middle = 0.5 * (start + end)
        sections = math.floor(end - start) if end - start < SECTIONS else SECTIONS
        apart = (end - start) / sections
        for _ in range(3):
            # the height of the ridge is fitted with the line held, then the line with the height held
            hp = 0.0
            used = 0
            for k in range(sections):
                along = start + (k + 0.5) * apart
                across = a + b * (along - middle)
                rest = skip(rest_of, k * _WIDE)  # each section less its own level and tilt
                rest[0] = math.nan
                x, y = bx + ux * along - uy * (across - ENDS), by + uy * along + ux * (across - ENDS)
                ex, ey = x - 2 * ENDS * uy, y + 2 * ENDS * ux
                if (x if x < ex else ex) < 0.0 or (x if x > ex else ex) >= places[COLUMNS] - 1:
                    continue
                if (y if y < ey else ey) < 0.0 or (y if y > ey else ey) >= places[ROWS] - 1:
                    continue
                at_x, at_y = int(x * FINE), int(y * FINE)
                for j in range(2 * ENDS + 1):
                    profile[j] = brightness(picture, down, right, at_x, at_y)
                    at_x -= step_y
                    at_y += step_x
                level = tilt = 0.0
                for j in range(3):
                    level += (profile[j] + profile[2 * ENDS - j]) / 6.0
                    tilt += (profile[2 * ENDS - j] - profile[j]) / 42.0
                for j in range(_WIDE):
                    rest[j] = profile[j + ENDS - HALF] - level - tilt * (j - HALF)
                    hp += shape[j] * rest[j]
                used += 1
            if used < 12:
                return
            hh = used * square
            height = hp / hh
            n00 = n01 = n11 = r0 = r1 = squares = 0.0
            count = 0
            for k in range(sections):
                rest = skip(rest_of, k * _WIDE)
                if rest[0] != rest[0]:
                    continue
                lever = start + (k + 0.5) * apart - middle
                steep = pull = 0.0
                for j in range(_WIDE):
                    left = rest[j] - height * shape[j]
                    if abs(left) > 1.5 * abs(height) + 12.0:
                        continue
                    slope = height * shape[j] * ((j - HALF) / WIDTH2)
                    steep += slope * slope
                    pull += slope * left
                    squares += left * left
                    count += 1
                n00 += steep
                n01 += steep * lever
                n11 += steep * lever * lever
                r0 += pull
                r1 += pull * lever
            determinant = n00 * n11 - n01 * n01
            if count < 60 or not determinant > 1e-12 * n00 * n11:
                return
            da, db = (r0 * n11 - r1 * n01) / determinant, (r1 * n00 - r0 * n01) / determinant
            a += 2.0 if da > 2.0 else -2.0 if da < -2.0 else da
            b += 0.05 if db > 0.05 else -0.05 if db < -0.05 else db
            noise = math.sqrt(squares / count)
            strength = abs(height) * math.sqrt(hh) / noise
            if abs(da) < least and abs(db) * (end - start) < least:
                break
        if strength < 8.0 or abs(height) < 1.5:
            return
    lever = n01 / n00  # to the point at which place and direction are independent
    across = a + b * lever
    result[0] = 1.0
    result[1] = bx + ux * (middle + lever) - uy * across  # across is along (−uy, ux)
    result[2] = by + uy * (middle + lever) + ux * across
    result[3], result[4] = ux - uy * b, uy + ux * b
    least = n11 - n01 * n01 / n00
    result[5] = noise / math.sqrt(least if least > 1e-30 else 1e-30)
    result[6] = noise / math.sqrt(n00)
    result[7] = strength
    result[8] = b
