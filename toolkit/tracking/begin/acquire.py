"""The bob found in the frames read ahead: hypotheses are followed, and the one that swings is taken.

At first against a wall of one level. Where that does not show the bob on most frames (clutter, a post, a shadow), against
the still picture that the frames themselves show, and by its silhouette (a bob with a pattern).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from toolkit.errors import JobError
from toolkit.trackers.localiser import Look
from toolkit.tracking.begin.rival import find_rival
from toolkit.tracking.begin.search import Hypothesis, find_round_movers
from toolkit.tracking.begin.trail import Rough, Stage, Trail, begin_trail, cut
from toolkit.tracking.geometry.beside import go_side_by_side
from toolkit.tracking.picture.plane import even_light, shrink, silhouette, still_picture
from toolkit.tracking.picture.repeat import repeats
from toolkit.tracking.picture.sight import LUMA, Sight, best_sight, small_planes
from toolkit.video import Frame

_FOLLOWED = 8  # hypotheses at most
_MOST = 0.9  # of the frames: a bob seen on fewer is looked for in other ways too
_ALL = 0.97  # of few frames
_SWUNG = 0.4  # of a period: in so much of it a bob turns, or passes its lowest point, or both
_CALM = 0.15  # of the radius: what strays farther from a swing is lost now and then, or the camera shakes
_SHADOWED = 0.3  # of its shadow's clearness a bob has at least
_MOSTLY = 0.7  # of the frames a shadow goes with its bob
REMEDY = "give --bob X,Y (its centre in px on the first frame)"


def find_clear_bob(batch: list[Frame], bob: tuple[float, float] | None, radius: float | None) -> Rough | None:
    """A bob of one shade that is seen on all of few frames, and of whose swing they show enough to know it; None where nothing is so
    clear."""
    repeated = repeats(batch)
    candidates, samples = _hypotheses(batch, bob, radius, colour=False)
    best = _likeliest(batch, candidates, samples, radius, repeated)
    if best is None or not _is_clear(best, _ALL * (len(batch) - len(repeated))):
        return None
    return _in_best_sight(batch, best, radius, repeated) if _swings(batch, best) else None


def find_bob(batch: list[Frame], bob: tuple[float, float] | None, radius: float | None, what: str) -> Rough:
    """The thing in `batch` that is round and swings. `bob` is where it is on the first frame, if the user said so.

    Raises JobError where there is none, naming the file by `what`.
    """
    repeated = repeats(batch)
    candidates, samples = _hypotheses(batch, bob, radius, colour=False)
    moved = bool(candidates)
    best = _likeliest(batch, candidates, samples, radius, repeated)
    most = _MOST * (len(batch) - len(repeated))
    if not _is_clear(best, most):
        still = still_picture([batch[i].luma for i in scattered(len(batch))])
        movers = [c for c in _movers_before(batch, still, samples, radius) if bob is None]
        moved = moved or bool(movers)
        for alike, extra in ((False, [*candidates, *movers]), (True, [*movers, *candidates])):
            other = _likeliest(batch, extra, samples, radius, repeated, Stage(still, alike))
            if other is not None and (best is None or _weight(batch, other, still) > _weight(batch, best, still)):
                best = other
    if not _is_clear(best, most):  # of a bob as bright as the wall brightness shows the string's end
        candidates, samples = _hypotheses(batch, bob, radius, colour=True)
        moved = moved or bool(candidates)
        other = _likeliest(batch, candidates, samples, radius, repeated)
        if other is not None and (best is None or (_is_clear(other, most) and _is_another(best, other))):
            best = other
    if best is not None:
        return _in_best_sight(batch, best, radius, repeated)
    if not moved:
        raise JobError(f"nothing that moves was found in {what}; film the swinging bob, or {REMEDY}")
    raise JobError(f"nothing in {what} moves like a pendulum; if there is one, {REMEDY}")


def _likeliest(
    batch: list[Frame],
    candidates: list[tuple[Sight, Hypothesis]],
    samples: list[int],
    radius: float | None,
    repeated: frozenset[int],
    stage: Stage | None = None,
) -> Rough | None:
    """The hypothesis that, followed, swings best. What was followed once is not followed again, nor what looks so poor that it
    could neither be better than the best nor the bob of which that is the shadow."""
    roughs: list[Rough] = []
    trails: list[Trail] = []
    for sight, h in candidates:
        start = samples[h.sample]
        if len(trails) == _FOLLOWED:
            break
        if any(trail.holds(h, start) for trail in trails):
            continue
        trail = begin_trail(batch, start, h, sight, radius, repeated, stage)
        if trail is None:
            continue
        known = any(other.meets(trail) for other in trails)
        trails.append(trail)
        enough = _SHADOWED * max((rough.score for rough in roughs), default=0.0)
        rough = None if known or trail.hope < enough else trail.follow(radius)
        if rough is not None:
            roughs.append(rough)
    best = max(roughs, key=lambda rough: rough.score, default=None)
    if best is None:
        return None
    best = next((rough for rough in roughs if _is_shadow_of(best, rough)), best)
    return replace(best, rival_px=find_rival(best, (rough for rough in roughs if _swings(batch, rough))))


def _swings(batch: list[Frame], rough: Rough) -> bool:
    """Do the frames show enough of its swing to know it?"""
    swing, size_px = rough.swing, rough.look.radius_px
    extent_px = np.hypot(*np.ptp(list(rough.points.values()), axis=0))
    return bool(
        swing.values[4] > 0
        and batch[-1].t_s - batch[0].t_s >= _SWUNG * swing.period_s
        and extent_px >= 2 * size_px
        and swing.rms_px <= _CALM * size_px
    )


def _is_shadow_of(one: Rough, other: Rough) -> bool:
    """Does it go with the other, beside it, fainter and softer? The other may have been lost on some frames."""
    common = sorted(one.points.keys() & other.points.keys())
    if len(common) < _MOSTLY * len(one.points) or not other.clearness > _SHADOWED * one.clearness:
        return False
    fainter = abs(one.look.contrast) < 0.8 * abs(other.look.contrast) and one.look.edge_px > other.look.edge_px
    path, its_path = (np.array([rough.points[i] for i in common]).T for rough in (one, other))
    return fainter and go_side_by_side(path, its_path, max(one.look.radius_px, other.look.radius_px))


def _weight(batch: list[Frame], rough: Rough, still: np.ndarray) -> float:
    """The score, and how well the disc is all that differs from the still picture, and nothing but it."""
    radius = rough.look.radius_px
    shares = []
    for i in list(rough.points)[:: max(1, len(rough.points) // 8)]:
        x, y = rough.points[i]
        patch = cut(batch[i], Sight(LUMA), x, y, 2 * radius + 4)
        if patch is None:
            continue
        rows, columns = patch.image.shape
        x0, y0 = int(patch.x_px), int(patch.y_px)
        differs = 0.01 * silhouette(patch.image, still[y0 : y0 + rows, x0 : x0 + columns].astype(np.float32))
        inside = np.hypot(*np.ogrid[-(y - y0) : rows - (y - y0) - 0.5, -(x - x0) : columns - (x - x0) - 0.5]) < radius
        shares.append(differs[inside].sum() / (differs[~inside].sum() + inside.sum()))
    return rough.score * float(np.median(shares)) ** 2 if shares else 0.0


def _is_clear(found: Rough | None, most: float) -> bool:
    """Was a bob of one shade found on so many frames?"""
    return found is not None and len(found.points) >= most and is_even(found.look)


def _is_another(one: Rough, other: Rough) -> bool:
    """Is the other something else, and does it swing better?"""
    common = one.points.keys() & other.points.keys()
    apart = [np.hypot(*np.subtract(one.points[i], other.points[i])) for i in common]
    same = apart and float(np.median(apart)) < 0.5 * other.look.radius_px
    return other.score > one.score and not same


def is_even(look: Look) -> bool:
    """Does a disc of one shade before a wall of one level describe it?"""
    return look.noise < 0.2 * abs(look.contrast)


def scattered(n: int, count: int = 9) -> list[int]:
    """Some of n frames, in no step with any swing."""
    return sorted({int(n * (k * 0.6180339887 % 1)) for k in range(count)})


def _movers_before(
    batch: list[Frame], still: np.ndarray, samples: list[int], radius: float | None
) -> list[tuple[Sight, Hypothesis]]:
    """Round silhouettes before the still picture."""
    factor = _shrinking(batch)
    small = shrink(still, factor)
    pictures = [shrink(batch[i].luma, factor) for i in samples]
    gains = [float(np.median(p[::4, ::4] / np.maximum(small[::4, ::4], 1.0))) for p in pictures]
    away = [np.abs(p - g * small) for p, g in zip(pictures, gains)]
    some = np.stack(away)
    clear = max(8.0, 6 * float(np.median(some)), 0.3 * float(np.percentile(some, 99.95)))
    silhouettes = [100 * np.minimum(a / clear, 1) for a in away]
    return [
        (Sight(LUMA), h._replace(radius_px=radius or h.radius_px))
        for h in find_round_movers(silhouettes, factor)
        if h.sign > 0
    ]


def _shrinking(batch: list[Frame]) -> int:
    return max(1, round(batch[0].luma.shape[1] / 420))


def _hypotheses(
    batch: list[Frame], bob: tuple[float, float] | None, radius: float | None, colour: bool
) -> tuple[list[tuple[Sight, Hypothesis]], list[int]]:
    samples = sorted({round(i) for i in np.linspace(0, len(batch) - 1, 16)})
    sights = [Sight((0.0, 1.0, 0.0)), Sight((0.0, 0.0, 1.0))] if colour else [Sight(LUMA)]
    if colour and batch[0].chroma is None:
        return [], samples
    if bob is not None:
        radii = [radius] if radius else [20.0, 12.0, 32.0, 7.5, 50.0, 4.5, 80.0]
        return [(s, Hypothesis(0, *bob, r, 0, 1.0)) for s in sights for r in radii], samples
    factor = _shrinking(batch)
    pictures = [small_planes(batch[i], factor, colour) for i in samples]
    found = []
    for k, sight in enumerate(sights):
        planes = [p[k] for p in pictures]
        movers = find_round_movers(planes if colour else even_light(planes), factor)
        found += [(sight, h._replace(radius_px=radius or h.radius_px)) for h in movers]
    return found, samples


def _in_best_sight(batch: list[Frame], rough: Rough, radius: float | None, repeated: frozenset[int]) -> Rough:
    """The same thing, looked at in the mix of planes in which it stands out best."""
    some = list(rough.points)[:: max(1, len(rough.points) // 8)]
    sight = best_sight([batch[i] for i in some], [rough.points[i] for i in some], rough.look.radius_px)
    if sight == rough.sight:
        return rough
    start = some[len(some) // 2]
    h = Hypothesis(0, *rough.points[start], rough.look.radius_px, 0, 1.0)
    trail = begin_trail(batch, start, h, sight, radius, repeated)
    other = None if trail is None else trail.follow(radius)
    if other is None or other.score <= rough.score:
        return rough
    return replace(other, rival_px=rough.rival_px)
