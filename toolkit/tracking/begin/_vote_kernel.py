"""The compiled inside of the search: edge pixels vote for a centre, and the two places that gathered most are found."""

from __future__ import annotations

import math
from typing import Any

from toolkit.motion.kernels.pointer import pixels, reals, skip, wholes

# The caller's places: addresses of the edge pixels (five lists: column, row, gradient's direction x and y, weight), of the
# numbers (two lists: signed distances of the centre, sizes of a bin), of the table of bins, of room for each pixel's bin, and
# of the result (two rows a distance: column, row, votes); then how many pixels and distances there are, and rows and columns
# of the picture. The table is all zero before and after.
EDGES, NUMBERS, TABLE, BINS, FOUND, COUNT, REACHES, ROWS, COLUMNS = range(9)


def vote(places: Any) -> None:
    """Find the two bins about which most votes lie; a bright bob's gradient points inwards, a dark one's outwards."""
    columns, table, bins, found = (
        reals(places, EDGES),
        pixels(places, TABLE),
        wholes(places, BINS),
        reals(places, FOUND),
    )
    count = places[COUNT]
    rows, nx, ny = skip(columns, count), skip(columns, 2 * count), skip(columns, 3 * count)
    weight = skip(columns, 4 * count)
    for k in range(places[REACHES]):
        reach, size = reals(places, NUMBERS)[k], reals(places, NUMBERS)[places[REACHES] + k]
        part = 1.0 / size
        height, width = math.floor(places[ROWS] / size) + 3, math.floor(places[COLUMNS] / size) + 3
        for i in range(count):
            u = math.floor((columns[i] + reach * nx[i]) * part + 0.5) + 1
            v = math.floor((rows[i] + reach * ny[i]) * part + 0.5) + 1
            bins[i] = 0
            if 0 < u < width - 1 and 0 < v < height - 1:
                bins[i] = v * width + u
                table[bins[i]] += weight[i]
        apart = math.floor(abs(reach) / size) + 1
        for which in range(2):
            best, at = -1.0, 0
            for i in range(count):
                here = bins[i]
                if table[here] > 0.0:
                    total = 0.0
                    for b in range(-1, 2):
                        for a in range(-1, 2):
                            total += table[here + b * width + a]
                    if total > best or (total == best and here < at):
                        best, at = total, here
            if at == 0:
                break
            at_v = at // width
            at_u = at - at_v * width
            sum_u = sum_v = total = 0.0
            for b in range(-1, 2):
                for a in range(-1, 2):
                    w = table[at + b * width + a]
                    sum_u += w * (at_u + a)
                    sum_v += w * (at_v + b)
                    total += w
            found[6 * k + 3 * which] = (sum_u / total - 1) * size
            found[6 * k + 3 * which + 1] = (sum_v / total - 1) * size
            found[6 * k + 3 * which + 2] = total
            left, right = max(at_u - apart, 0), min(at_u + apart + 1, width)
            for v in range(max(at_v - apart, 0), min(at_v + apart + 1, height)):  # the second is another one
                for u in range(left, right):
                    table[v * width + u] = 0.0
        for i in range(count):
            table[bins[i]] = 0.0
