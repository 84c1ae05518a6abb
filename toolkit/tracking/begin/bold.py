"""A bob with a pattern, parts of which may be as bright as the wall: its size, edge and exposure by its outline alone.

A disc's fit takes what is drawn on the bob for its edge, and what of it is as bright as the wall for wall; with a size, an edge or
a streak that is not the bob's, what shows of the outline draws its centre now to this side, now to that. So the radius is the one
that the outlines on most frames agree on, and edge and exposure are the likeliest, by all that the outline may look like.
How far it strays from a swing tells none of this: so do lost and repeated frames, a lens, a hand.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from toolkit.trackers.edge import Outline, fit_outline, unlikely
from toolkit.trackers.localiser import Guess, Look, Patch
from toolkit.tracking.geometry.swing import Swing, fit_swing
from toolkit.tracking.picture.looks import Looks, Sightings, light_on

_EDGES = 0.4, 0.6, 0.9, 1.3, 1.9, 2.8  # px, each half as much again
_PARTS = np.linspace(0, 1, 11)  # of the time from one frame to the next
# px: ways in a frame's time that tell the exposure; a shorter streak is like a softer edge
_LONGEST, _SHORTEST = 24.0, 4.0
_MANY = 32  # sightings that are looked at,
_FEW = 10  # by which edge and exposure are told
_MOST = 0.6  # of them
_ROUNDS = 6
_SPREAD = 0.1  # of the radius, about which little is known
_FITS, _FAR = 4, 3.5  # of a swing; times the median distance from it, beyond which hardly a place is by chance
_SETTLED = 0.05  # px
_RANGE = 1.3  # times the radius at first, at most
STEADY = 0.1  # of the radius: what strays more from a swing is not where that says


class Bold(NamedTuple):
    """The looks, the motion through the places found with them, and whether this says where the bob is better than they do."""

    looks: Looks
    swing: Swing
    calm: bool


def learn_bold(
    seen: Sightings, t_s: np.ndarray, look: Look, swing: Swing, radius: float | None, interval_s: float
) -> Bold | None:
    """The bob that was seen at times t_s (n,), looks about like `look` and swings about so; its `radius` if that is known. None
    where its outline is not found on most frames."""
    first_px, best = look.radius_px, None
    look = look._replace(contrast=_contrast(seen, look), edge_px=_EDGES[2], radius_free=False, even=False)
    exposure_s = 0.0
    centres = {k: (float(seen.x_px[k]), float(seen.y_px[k])) for k in range(0, t_s.size, max(1, t_s.size // _MANY))}
    way_px = interval_s * np.hypot(seen.vx, seen.vy)
    look = look._replace(edge_px=_likeliest_edge(seen, look, centres, way_px))
    for _ in range(_ROUNDS):
        fits = {}
        for k, centre in centres.items():
            guess, patch = seen.show(k, look, centre, exposure_s)
            fit = None if patch is None else fit_outline(patch, look, guess, _SPREAD * look.radius_px)
            if fit is not None:
                fits[k] = fit
        if len(fits) < _FEW:
            return None
        places = {k: (fit.place.x_px, fit.place.y_px) for k, fit in fits.items()}
        through = _steady_swing(t_s, places, swing)
        size = radius or _agreed([fits[k] for k in sorted(fits, key=lambda k: way_px[k])[: len(fits) // 2]])
        if through is None or not 1 / _RANGE < size / first_px < _RANGE:
            return None
        # a motion fitted to a bob that a hand holds may run beyond all numbers
        before, calm = look, through.rms_px < STEADY * size and bool(np.isfinite(through.position(t_s)).all())
        centres |= dict(zip(centres, positions(through, t_s[list(centres)]))) if calm else places
        look = look._replace(radius_px=size, noise=float(np.median([fit.place.misfit for fit in fits.values()])))
        look = look._replace(edge_px=_likeliest_edge(seen, look, centres, way_px))
        exposure_s = interval_s * _likeliest_part(seen, look, centres, way_px, interval_s)
        best = Bold(Looks(look, exposure_s), through, calm)
        if abs(size - before.radius_px) < _SETTLED and abs(look.edge_px - before.edge_px) < 2 * _SETTLED:
            break
    return best if len(fits) >= _MOST * len(centres) else None


def on_swing(places: dict[int, tuple[float, float]], t_s: np.ndarray, swing: Swing) -> dict[int, tuple[float, float]]:
    """The places, seen at times t_s (n,), as the swing draws them; as they are where it runs beyond all numbers."""
    drawn = positions(swing, t_s)
    return dict(zip(places, drawn)) if np.isfinite(drawn).all() else places


def positions(swing: Swing, t_s: np.ndarray) -> list[tuple[float, float]]:
    """The swing's places (x, y) in px at times t_s."""
    return list(zip(*(c.tolist() for c in swing.position(t_s))))


def _steady_swing(t_s: np.ndarray, places: dict[int, tuple[float, float]], start: Swing) -> Swing | None:
    """The swing through most of the places, by their number in t_s (n,): without those that are far from it."""
    t, (x, y) = t_s[list(places)], np.array(list(places.values())).T
    used, swing = np.ones(t.size, bool), None
    for _ in range(_FITS):
        first = t[used][0]
        swing = fit_swing(t[used], x[used], y[used], np.full(used.sum(), 0.3), (swing or start).values_at(first))
        if swing is None:
            return None
        px, py = swing.position(t)
        off = np.hypot(px - x, py - y)
        near = off < _FAR * np.median(off)
        if near.sum() < _MOST * t.size or np.array_equal(near, used):
            break
        used = near
    return swing


def _agreed(slow: list[Outline]) -> float:
    """The weighted median of their radii: where half of an outline is like the wall, it tells none."""
    slow.sort(key=lambda fit: fit.radius_px)
    weights = np.cumsum([1 / fit.variance_px2 for fit in slow])
    return float(np.interp(0.5 * weights[-1], weights, [fit.radius_px for fit in slow]))


def _likeliest_edge(seen: Sightings, look: Look, centres: dict[int, tuple[float, float]], way_px: np.ndarray) -> float:
    """The edge (px) that the slowest of these sightings are likeliest to have."""
    slow = sorted(centres, key=lambda k: way_px[k])[:_FEW]
    wide = look._replace(edge_px=_EDGES[-1])
    shown = [pair for pair in (seen.show(k, wide, centres[k], 0.0) for k in slow) if pair[1] is not None]
    reach = 2.2 * _EDGES[-1]

    def cost(edge: float) -> float:
        return _mean_unlikely([(patch, look._replace(edge_px=edge), guess) for guess, patch in shown], reach, True)

    return _least(cost, _EDGES, 2)


def _likeliest_part(
    seen: Sightings, look: Look, centres: dict[int, tuple[float, float]], way_px: np.ndarray, interval_s: float
) -> float:
    """Which part of a frame's time the exposure is likeliest to last, by the fastest of these sightings whose whole way is not too
    long to be looked along."""
    fast = sorted((k for k in centres if _SHORTEST < way_px[k] < _LONGEST), key=lambda k: -way_px[k])[:_FEW]
    shown = [pair for pair in (seen.show(k, look, centres[k], interval_s) for k in fast) if pair[1] is not None]
    if not shown:
        return 0.0
    reach = 2.2 * look.edge_px + 0.5 * float(np.ceil(max(way_px[fast])))

    def cost(part: float) -> float:
        streaks = [g._replace(streak_x_px=part * g.streak_x_px, streak_y_px=part * g.streak_y_px) for g, _ in shown]
        return _mean_unlikely([(patch, look, g) for g, (_, patch) in zip(streaks, shown)], reach, False)

    return _least(cost, _PARTS, 0)


def _mean_unlikely(shown: list[tuple[Patch | None, Look, Guess]], reach_px: float, shells: bool) -> float:
    costs = [unlikely(patch, look, guess, reach_px, shells) for patch, look, guess in shown if patch is not None]
    return float(np.mean([c for c in costs if np.isfinite(c)] or [0.0]))


def _least(cost: Callable[[float], float], values: Sequence[float] | np.ndarray, start: int) -> float:
    """The value of least cost, downhill from the one at `start`: between those given by a parabola."""
    known: dict[int, float] = {}
    at, best = -1, start
    while at != best:
        at = best
        for k in {at - 1, at, at + 1} & set(range(len(values))) - known.keys():
            known[k] = cost(float(values[k]))
        best = min(known, key=lambda k: known[k])
    place = float(at)
    if 0 < at < len(values) - 1:
        a, b, c = known[at - 1], known[at], known[at + 1]
        place += 0.5 * (a - c) / max(a - 2 * b + c, 1e-12)
    return float(np.interp(place, np.arange(len(values)), values))


def _contrast(seen: Sightings, look: Look) -> float:
    """Bob less wall, by the larger half of what differs well within the outline."""
    found = [np.zeros(1)]
    for k in range(0, seen.x_px.size, max(1, seen.x_px.size // 12)):
        x, y = float(seen.x_px[k]), float(seen.y_px[k])
        patch = seen.show(k, look, (x, y), 0.0)[1]
        if patch is not None:
            rows, columns = np.ogrid[: patch.image.shape[0], : patch.image.shape[1]]
            near = np.hypot(columns + patch.x_px - x, rows + patch.y_px - y) < 0.6 * look.radius_px
            found.append((patch.image - light_on(patch) * patch.back)[near])
    values = np.concatenate(found)
    return float(np.mean(values[np.abs(values) >= np.median(np.abs(values))]))
