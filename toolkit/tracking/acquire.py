"""The bob found in the frames read ahead: hypotheses are followed, and the one that swings is taken.

At first against a wall of one level. Where that does not show the bob on most frames (clutter, a post, a shadow), against
the still picture that the frames themselves show, and by its silhouette (a bob with a pattern).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from toolkit.errors import JobError, UsageError
from toolkit.trackers.disc import fit_disc
from toolkit.trackers.localiser import Guess, Look, Patch
from toolkit.tracking.search import (
    Hypothesis,
    even_light,
    find_round_movers,
    find_round_near,
    rim_level,
    shrink,
    silhouette,
    still_picture,
)
from toolkit.tracking.sight import LUMA, Sight, best_sight, small_planes
from toolkit.tracking.swing import Swing, fit_swing, start_swing
from toolkit.video import Frame

_FOLLOWED = 8  # hypotheses at most
_MOST = 0.9  # of the frames: a bob seen on fewer is looked for in other ways too
REMEDY = "give --bob X,Y (its centre in px on the first frame)"


@dataclass(frozen=True)
class Rough:
    """A hypothesis that was followed: the bob's looks, its motion, centre by index of the frame, and a score."""

    look: Look
    swing: Swing
    points: dict[int, tuple[float, float]]
    score: float
    sight: Sight


class Trail(NamedTuple):
    """Where something of this radius was seen, by the index of the frame."""

    radius_px: float
    points: dict[int, tuple[float, float]]


class Stage(NamedTuple):
    """The still picture that hypotheses are followed before; with `silhouette` all that differs from it looks alike."""

    still: np.ndarray
    silhouette: bool


def _repeats(batch: list[Frame]) -> frozenset[int]:
    """Frames that show the one before once more; none where that is no exception (nothing moves between frames)."""
    prints = [f.luma[4::16, 4::16].astype(np.int16) for f in batch]
    found = frozenset(i for i in range(1, len(batch)) if np.abs(prints[i] - prints[i - 1]).max() <= 1)
    return found if len(found) < 0.3 * len(batch) else frozenset()


def find_bob(batch: list[Frame], bob: tuple[float, float] | None, radius: float | None, what: str) -> Rough:
    """The thing in `batch` that is round and swings. `bob` is where it is on the first frame, if the user said so.

    Raises JobError where there is none, naming the file by `what`.
    """
    height, width = batch[0].luma.shape
    if bob is not None and not (0 <= bob[0] < width and 0 <= bob[1] < height):
        raise UsageError(f"bob ({bob[0]:g}, {bob[1]:g}) lies outside the picture of {width}×{height} px")
    repeated = _repeats(batch)
    candidates, samples = _hypotheses(batch, bob, radius, colour=False)
    moved = bool(candidates)
    best = _likeliest(batch, candidates, samples, radius, repeated)
    if best is None or len(best.points) < _MOST * (len(batch) - len(repeated)) or not is_even(best.look):
        still = still_picture([batch[i].luma for i in scattered(len(batch))])
        movers = [c for c in _movers_before(batch, still, samples, radius) if bob is None]
        moved = moved or bool(movers)
        for alike, extra in ((False, [*candidates, *movers]), (True, [*movers, *candidates])):
            other = _likeliest(batch, extra, samples, radius, repeated, Stage(still, alike))
            if other is not None and (best is None or _weight(batch, other, still) > _weight(batch, best, still)):
                best = other
    if best is None:
        candidates, samples = _hypotheses(batch, bob, radius, colour=True)
        moved = moved or bool(candidates)
        best = _likeliest(batch, candidates, samples, radius, repeated)
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
    """The hypothesis that, followed, swings best. What was followed once is not followed again."""
    best: Rough | None = None
    trails: list[Trail] = []
    for sight, h in candidates:
        start = samples[h.sample]
        if len(trails) == _FOLLOWED:
            break
        if any(_same(trail, h, start) for trail in trails):
            continue
        rough = _follow(batch, start, h, sight, radius, repeated, stage, trails)
        if rough is not None and (best is None or rough.score > best.score):
            best = rough
    return best


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


def _same(trail: Trail, h: Hypothesis, start: int) -> bool:
    """Is the hypothesis on the thing that was followed already?"""
    place = trail.points.get(start)
    return (
        place is not None
        and bool(np.hypot(place[0] - h.x_px, place[1] - h.y_px) < 0.7 * trail.radius_px)
        and h.radius_px < 1.5 * trail.radius_px
    )


def _follow(
    batch: list[Frame],
    start: int,
    h: Hypothesis,
    sight: Sight,
    radius: float | None,
    repeated: frozenset[int] = frozenset(),
    stage: Stage | None = None,
    trails: list[Trail] | None = None,
) -> Rough | None:
    """Follow a hypothesis through the batch, against a wall of one level or on a stage; None unless it swings.

    Where it was seen is added to `trails`, whether it swings or not.
    """

    def fit_at(i: int, look: Look, guess: Guess, free: bool = False) -> tuple[float, float, Look] | None:
        return rough_fit(batch[i], sight, look, guess, stage, free)

    outlined = stage is not None and stage.silhouette
    first = fit_at(start, Look(h.radius_px, max(0.8, 0.12 * h.radius_px)), Guess(h.x_px, h.y_px), free=True)
    if first is None:
        return None
    x, y, look = first
    if not (radius or 0.4 < look.radius_px / h.radius_px < 2.2):
        return None
    points = {start: (x, y)}
    looks = [look]
    if trails is not None:
        trails.append(Trail(look.radius_px, points))

    def by_silhouette(i: int, guess: Guess) -> tuple[float, float, Look] | None:
        patch = _on_stage(batch[i], sight, guess.x_px, guess.y_px, 2.2 * look.radius_px + 6, stage)
        found = None if patch is None else find_round_near(patch.image, look.radius_px, 1, look.edge_px)
        if patch is None or found is None or found[2] < 0.5:
            return None
        return found[0] + patch.x_px, found[1] + patch.y_px, look

    def take(i: int, guess: Guess) -> bool:
        fit = by_silhouette(i, guess) if outlined else fit_at(i, look, guess)
        if not outlined:  # where a wide look does not settle (a highlight on a streaked bob) a close one may
            fit = fit_at(i, look, guess if fit is None else Guess(fit[0], fit[1]), free=True)
        if fit is None or not 0.7 < fit[2].radius_px / look.radius_px < 1.4:
            return False
        if not 0.4 < fit[2].contrast / look.contrast < 2.0:
            return False
        if np.hypot(fit[0] - guess.x_px, fit[1] - guess.y_px) > 0.8 * look.radius_px + 3:
            return False
        points[i] = fit[:2]
        looks.append(fit[2])
        return True

    def look_around(i: int, x: float, y: float, step: float) -> bool:
        """Not where it should be: the outline of its size that gathers most votes within some diameters and `step`s."""
        patch = _on_stage(batch[i], sight, x, y, 5.5 * look.radius_px + 4 + 2 * step, stage)
        if patch is None:
            return False
        found = find_round_near(patch.image - patch.back, look.radius_px, 1 if look.contrast > 0 else -1, look.edge_px)
        if found is None or found[2] < 0.5:
            return False
        return take(i, Guess(found[0] + patch.x_px, found[1] + patch.y_px))

    for way in (1, -1):
        recent = [(batch[start].t_s, x, y)]
        misses = 0
        i = start + way
        while 0 <= i < len(batch) and misses < 4:
            if i in repeated:
                i += way
                continue
            ahead = extrapolate(recent, batch[i].t_s)
            speed = np.hypot(recent[-1][1] - recent[-2][1], recent[-1][2] - recent[-2][2]) if recent[1:] else 0.0
            if take(i, Guess(*ahead)) or look_around(i, *recent[-1][1:], min(float(speed), 4 * look.radius_px)):
                recent = [*recent, (batch[i].t_s, *points[i])][-3:]
                misses = 0
            else:
                misses += 1
            i += way
    swing = _swing_of(batch, points, look)
    tried: set[int] = set()
    while swing is not None and len(points) < len(batch):  # what lies behind a gap: where the motion says
        left = [i for i in range(len(batch)) if i not in points and i not in tried and i not in repeated]
        if not left:
            break
        near = [i for i in left if min(abs(i - p) for p in points) <= 24] or left[:1]
        where = swing.position(np.array([batch[i].t_s for i in near]))
        before = len(points)
        for i, gx, gy in zip(near, *where):
            tried.add(i)
            take(i, Guess(float(gx), float(gy)))
        if len(points) > before:
            swing = _swing_of(batch, points, look)
    if swing is None or len(points) < max(12, 0.3 * len(batch)):
        return None
    size, edge, contrast, noise = (float(np.median([k[n] for k in looks])) for n in range(4))
    look = Look(size, edge, contrast, noise)
    if radius:
        look = look._replace(radius_px=radius)
    quality = abs(contrast) / (noise + 1.0)
    extent = float(np.hypot(*np.ptp(list(points.values()), axis=0)))
    moved = min(1.0, 0.25 * extent / look.radius_px)  # what stands still on a wall that shakes explains little change
    score = (len(points) / len(batch)) ** 2 * quality * moved * look.radius_px**0.5 / (0.3 + swing.rms_px)
    if stage is not None and stage.silhouette:
        look = look._replace(contrast=_contrast(batch, points, look.radius_px, stage.still))
    return Rough(look, swing, {i: points[i] for i in sorted(points)}, score, sight)


def _contrast(batch: list[Frame], points: dict[int, tuple[float, float]], radius_px: float, still: np.ndarray) -> float:
    """Bob less still picture, by the larger half of what differs well within the outline."""
    found = []
    for i in list(points)[:: max(1, len(points) // 12)]:
        x, y = (round(v) for v in points[i])
        r = max(1, int(0.6 * radius_px))
        window = (slice(max(0, y - r), y + r + 1), slice(max(0, x - r), x + r + 1))
        found.append((batch[i].luma[window].astype(float) - still[window]).ravel())
    values = np.concatenate(found)
    return float(np.mean(values[np.abs(values) >= np.median(np.abs(values))]))


def _swing_of(batch: list[Frame], points: dict[int, tuple[float, float]], look: Look) -> Swing | None:
    """The pendulum motion through the points; None where they do not move like one."""
    if len(points) < 10:
        return None
    order = sorted(points)
    t = np.array([batch[i].t_s for i in order])
    x, y = np.array([points[i] for i in order]).T
    extent = float(np.hypot(np.ptp(x), np.ptp(y)))
    if extent < max(1.0, 0.05 * look.radius_px):
        return None  # it does not move
    start = start_swing(t, x, y)
    swing = None if start is None else fit_swing(t, x, y, np.full(t.size, 0.3), start)
    # a hand-held camera adds its own wandering: what is left when that is taken away is judged later
    wandering = 0.12 if len(points) > 0.9 * len(batch) else 0.05
    if swing is None or swing.rms_px > max(wandering * extent, 0.5):
        return None
    if swing.values[4] > 0 and swing.period_s < 5 * float(np.median(np.diff(t))):
        return None  # faster than these pictures could show
    line = np.column_stack([np.ones(t.size), t - t[0]])
    straight = np.column_stack([x, y]) - line @ np.linalg.lstsq(line, np.column_stack([x, y]), rcond=None)[0]
    if np.sqrt(np.mean(np.sum(straight**2, axis=1))) < 1.5 * swing.rms_px + 0.02 * extent:
        return None  # it passes by; what swings that slowly is found in more of the clip
    return swing


def _in_best_sight(batch: list[Frame], rough: Rough, radius: float | None, repeated: frozenset[int]) -> Rough:
    """The same thing, looked at in the mix of planes in which it stands out best."""
    some = list(rough.points)[:: max(1, len(rough.points) // 8)]
    sight = best_sight([batch[i] for i in some], [rough.points[i] for i in some], rough.look.radius_px)
    if sight == rough.sight:
        return rough
    start = some[len(some) // 2]
    h = Hypothesis(0, *rough.points[start], rough.look.radius_px, 0, 1.0)
    other = _follow(batch, start, h, sight, radius, repeated)
    return other if other is not None and other.score > rough.score else rough


def rough_fit(
    frame: Frame, sight: Sight, look: Look, guess: Guess, stage: Stage | None = None, free: bool = False
) -> tuple[float, float, Look] | None:
    """Disc fit against a wall of one level, the median of the patch's rim, or on a stage: (x, y, looks) or None.

    `free`: radius and edge are fitted too; else the edge is widened, to find the bob from far away.
    """
    patch = _on_stage(frame, sight, guess.x_px, guess.y_px, 1.6 * look.radius_px + 6, stage)
    if patch is None:
        return None
    how: dict[str, Any] = {"calibrate": True, "turns": 8} if free else {"soften": 2.5, "turns": 12}
    if free and look.contrast == 0.0:
        how = {"calibrate": True, "turns": 12, "soften": 2.0}
    out = fit_disc(patch, look._replace(noise=np.inf), guess, **how)
    if out is None or abs(out[9]) < 4:
        return None
    return out[0] + patch.x_px, out[1] + patch.y_px, Look(out[2], out[3], out[9], out[7])


def _on_stage(frame: Frame, sight: Sight, x: float, y: float, half: float, stage: Stage | None) -> Patch | None:
    """The patch with what is thought to stand behind the bob."""
    patch = cut(frame, sight, x, y, half)
    if patch is None:
        return None
    rows, columns = patch.image.shape
    if stage is None:
        level = max(rim_level(patch.image), 1.0)
        return patch._replace(back=np.full_like(patch.image, level), seen=np.zeros_like(patch.image))
    x0, y0 = int(patch.x_px), int(patch.y_px)
    back = stage.still[y0 : y0 + rows, x0 : x0 + columns].astype(np.float32)
    if stage.silhouette:
        image = 1.0 + silhouette(patch.image, back)  # the fit's gain needs a wall that is not black
        return patch._replace(image=image, back=np.ones_like(back), seen=np.zeros_like(back))
    return patch._replace(back=back, seen=np.full_like(back, 3.0))


def cut(frame: Frame, sight: Sight, x: float, y: float, half: float, half_y: float | None = None) -> Patch | None:
    """The patch of ±half px about (x, y), as far as it lies in the picture (`back` and `seen` are yet to be set)."""
    if half_y is None:
        half_y = half
    if not np.isfinite(x + y + half + half_y):
        return None
    height, width = frame.luma.shape
    x0, x1 = max(0, int(x - half)), min(width, int(x + half) + 2)
    y0, y1 = max(0, int(y - half_y)), min(height, int(y + half_y) + 2)
    if x1 - x0 < 6 or y1 - y0 < 6:
        return None
    image = sight.window(frame, x0, y0, x1, y1)
    return Patch(image, image, image, x0, y0)


def extrapolate(recent: list[tuple[float, float, float]], t: float) -> tuple[float, float]:
    """Through the last one, two or three points (t, x, y), to time t (Lagrange)."""
    x = y = 0.0
    for i, (ti, xi, yi) in enumerate(recent):
        weight = 1.0
        for j, (tj, _, _) in enumerate(recent):
            if i != j:
                weight *= (t - tj) / (ti - tj) if ti != tj else 0.0
        x += weight * xi
        y += weight * yi
    return x, y
