"""The compiled inside of the outline fit: how likely each ray finds each place of the outline.

Every loop runs over all rays that are blurred alike, so that the compiler makes vector instructions of it.
"""

from __future__ import annotations

import math
from typing import Any

from toolkit.motion.kernels.pointer import pixels, reals, skip, wholes
from toolkit.trackers._disc_kernel import loop

# The caller's places: addresses of the profiles (samples, rays), of the runs of rays that are blurred alike, of the levels
# that a shell may have (behind them their mean, and what a stray ray is worth), of what each shell's chance costs, of which
# rays count (0 or 1), of where each ray lies in the circle (all before are sorted by their blur), of room for a number a
# level, place, shell and ray and a few lists of rays more, of the costs (rays in the circle, places) and of each ray's least
# misfit (sorted); then how many there are of each. All are float32 but runs, the order and costs.
(
    PROFILE, RUNS, LEVELS, CHANCES, COUNTED, ORDER, ROOM, COSTS, LEAST,
    RAY_COUNT, RUN_COUNT, LEVEL_COUNT, PLACE_COUNT, SHELL_COUNT, ALIKE,
) = range(15)  # fmt: skip
# A run: its first ray and the one behind its last, its first sample and how many it has, how many of the shells it may have,
# then the addresses of its model's four arrays (see `edge._Model`).
FIRST_RAY, LAST_RAY, FIRST_SAMPLE, SAMPLES, SHELLS, WHITEN, WITHIN, SHELL, VOLUME, RUN = range(10)
_NEVER = 1e6  # the misfit of a shell that a run cannot have


@loop
def weave(whiten: Any, profile: Any, step: int, count: int, n: int, row: Any) -> None:
    """row = whiten · profile, for n rays."""
    for r in range(n):
        row[r] = whiten[0] * profile[r]
    for j in range(1, count):
        factor, sample = whiten[j], skip(profile, j * step)
        for r in range(n):
            row[r] += factor * sample[r]


@loop
def collect(row: Any, n: int, mean: Any, shell: Any, square: Any, along: Any) -> None:
    """Add one sample to the squares of what is white and to its product with the shell's part."""
    for r in range(n):
        v = row[r] - mean
        square[r] += v * v
        along[r] += shell * v


@loop
def offer(square: Any, along: Any, own: Any, level: Any, counted: Any, n: int, misfit: Any, least: Any) -> None:
    """Each ray's misfit with a shell of that level, and the least so far."""
    twice, rest = level + level, level * level * own
    for r in range(n):
        value = (square[r] - twice * along[r] + rest) * counted[r]
        misfit[r] = value
        least[r] = value if value < least[r] else least[r]


@loop
def share(
    misfit: Any, least: Any, order: Any, n: int, alike: int, stray: Any, row: Any, chance: Any, best: Any
) -> None:
    """Sum the misfits of neighbours, each worth `stray` at most, and keep the least sum."""
    half = alike // 2
    for r in range(n):
        off = misfit[r] - least[r]
        misfit[r] = off * stray / (stray + off)
    for r in range(n):
        row[half + order[r]] = misfit[r]
    for k in range(half):
        row[k] = row[n + k]
        row[half + n + k] = row[half + k]
    for r in range(n):
        misfit[r] = chance
    for k in range(2 * half + 1):
        near = skip(row, k)
        for r in range(n):
            misfit[r] += near[r]
    for r in range(n):
        best[r] = misfit[r] if misfit[r] < best[r] else best[r]


def weigh_places(places: Any) -> None:
    """Minus twice the log-likelihood of each place of the outline on each ray, by the best shell for it and its neighbours."""
    profile, runs, levels = pixels(places, PROFILE), wholes(places, RUNS), pixels(places, LEVELS)
    chances, counted, costs = pixels(places, CHANCES), pixels(places, COUNTED), reals(places, COSTS)
    order, misfit, least = wholes(places, ORDER), pixels(places, ROOM), pixels(places, LEAST)
    rays, level_count, shells, tried = places[RAY_COUNT], places[LEVEL_COUNT], places[SHELL_COUNT], places[PLACE_COUNT]
    kinds = tried * shells
    row = skip(misfit, level_count * kinds * rays)  # and ALIKE more, for the first rays are the last ones' neighbours
    square = skip(row, rays + places[ALIKE])
    along, best = skip(square, rays), skip(square, 2 * rays)
    mean, stray = levels[level_count], levels[level_count + 1]
    for r in range(rays):
        least[r] = math.inf
    for k in range(places[RUN_COUNT]):
        run = skip(runs, k * RUN)
        begin, size = run[FIRST_RAY], run[SAMPLES]
        n = run[LAST_RAY] - begin
        whiten, within = pixels(run, WHITEN), pixels(run, WITHIN)
        shell, volume = pixels(run, SHELL), pixels(run, VOLUME)
        mine = skip(profile, run[FIRST_SAMPLE] * rays + begin)
        for kind in range(kinds):
            place, d = kind // shells, kind % shells
            if d >= run[SHELLS]:
                for q in range(level_count):
                    out = skip(misfit, (q * kinds + kind) * rays + begin)
                    for r in range(n):
                        out[r] = _NEVER
                continue
            m = place * run[SHELLS] + d
            own = volume[m] - volume[m]
            for r in range(n):
                square[r] = volume[m]
                along[r] = own
            for i in range(size):
                at = m * size + i
                weave(skip(whiten, at * size), mine, rays, i + 1, n, row)
                collect(row, n, mean * within[at], shell[at], square, along)
                own += shell[at] * shell[at]
            for q in range(level_count):
                out = skip(misfit, (q * kinds + kind) * rays + begin)
                offer(square, along, own, levels[q], skip(counted, begin), n, out, skip(least, begin))
    for s in range(tried):
        for r in range(rays):
            best[r] = math.inf
        for q in range(level_count):
            for d in range(shells):
                kind = (q * tried + s) * shells + d
                share(skip(misfit, kind * rays), least, order, rays, places[ALIKE], stray, row, chances[d], best)
        for r in range(rays):
            costs[r * tried + s] = best[r] / places[ALIKE]
    for r in range(rays):
        low = costs[r * tried]
        for s in range(1, tried):
            low = costs[r * tried + s] if costs[r * tried + s] < low else low
        for s in range(tried):
            costs[r * tried + s] -= low
