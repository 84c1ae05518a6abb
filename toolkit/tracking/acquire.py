"""The bob found in the frames read ahead: hypotheses are followed, and the one that swings is taken."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from toolkit.errors import JobError, UsageError
from toolkit.trackers.disc import fit_disc
from toolkit.trackers.localiser import Guess, Look, Patch
from toolkit.tracking.search import Hypothesis, even_light, find_round_movers, find_round_near
from toolkit.tracking.sight import LUMA, Sight, best_sight, small_planes
from toolkit.tracking.swing import Swing, fit_swing, start_swing
from toolkit.video import Frame

REMEDY = "give --bob X,Y (its centre in px on the first frame)"


@dataclass(frozen=True)
class Rough:
    """A hypothesis that was followed: the bob's looks, its motion, centre by index of the frame, and a score."""

    look: Look
    swing: Swing
    points: dict[int, tuple[float, float]]
    score: float
    sight: Sight


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
    moved = False
    repeated = _repeats(batch)
    for colour in (False, True):
        candidates, samples = _hypotheses(batch, bob, radius, colour)
        moved = moved or bool(candidates)
        best: Rough | None = None
        for sight, h in candidates:
            start = samples[h.sample]
            if best is not None and _same(best, h, start):
                continue
            rough = _follow(batch, start, h, sight, radius, repeated)
            if rough is not None and (best is None or rough.score > best.score):
                best = rough
        if best is not None:
            return _in_best_sight(batch, best, radius, repeated)
    if not moved:
        raise JobError(f"nothing that moves was found in {what}; film the swinging bob, or {REMEDY}")
    raise JobError(f"nothing in {what} moves like a pendulum; if there is one, {REMEDY}")


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
    factor = max(1, round(batch[0].luma.shape[1] / 420))
    pictures = [small_planes(batch[i], factor, colour) for i in samples]
    found = []
    for k, sight in enumerate(sights):
        planes = [p[k] for p in pictures]
        movers = find_round_movers(planes if colour else even_light(planes), factor)
        found += [(sight, h._replace(radius_px=radius or h.radius_px)) for h in movers]
    return found, samples


def _same(rough: Rough, h: Hypothesis, start: int) -> bool:
    """Is the hypothesis on the thing that was followed already?"""
    place = rough.points.get(start)
    radius = rough.look.radius_px
    return (
        place is not None
        and bool(np.hypot(place[0] - h.x_px, place[1] - h.y_px) < 0.7 * radius)
        and h.radius_px < 1.5 * radius
    )


def _follow(
    batch: list[Frame],
    start: int,
    h: Hypothesis,
    sight: Sight,
    radius: float | None,
    repeated: frozenset[int] = frozenset(),
) -> Rough | None:
    """Follow a hypothesis through the batch against a wall of one level; None unless it swings."""
    first = flat_fit(
        batch[start], sight, Look(h.radius_px, max(0.8, 0.12 * h.radius_px)), Guess(h.x_px, h.y_px), free=True
    )
    if first is None:
        return None
    x, y, look = first
    if not (radius or 0.4 < look.radius_px / h.radius_px < 2.2):
        return None
    points = {start: (x, y)}
    looks = [look]

    def take(i: int, guess: Guess) -> bool:
        fit = flat_fit(batch[i], sight, look, guess)
        if fit is not None:
            fit = flat_fit(batch[i], sight, look, Guess(fit[0], fit[1]), free=True)
        if fit is None or not 0.7 < fit[2].radius_px / look.radius_px < 1.4:
            return False
        if not 0.4 < fit[2].contrast / look.contrast < 2.0:
            return False
        if np.hypot(fit[0] - guess.x_px, fit[1] - guess.y_px) > 0.8 * look.radius_px + 3:
            return False
        points[i] = fit[:2]
        looks.append(fit[2])
        return True

    def look_around(i: int, x: float, y: float) -> bool:
        """Not where it should be: the outline of its size that gathers most votes within some diameters."""
        patch = cut(batch[i], sight, x, y, 5.5 * look.radius_px + 4)
        if patch is None:
            return False
        found = find_round_near(patch.image, look.radius_px, 1 if look.contrast > 0 else -1, look.edge_px)
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
            if take(i, Guess(*extrapolate(recent, batch[i].t_s))) or look_around(i, *recent[-1][1:]):
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
    radius_px, edge, contrast, noise = (float(np.median([k[n] for k in looks])) for n in range(4))
    look = Look(radius_px, edge, contrast, noise)
    if radius:
        look = look._replace(radius_px=radius)
    quality = abs(look.contrast) / (look.noise + 1.0)
    score = len(points) / len(batch) * quality * look.radius_px**0.5 / (0.3 + swing.rms_px)
    return Rough(look, swing, {i: points[i] for i in sorted(points)}, score, sight)


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
    return _follow(batch, start, h, sight, radius, repeated) or rough


def flat_fit(
    frame: Frame, sight: Sight, look: Look, guess: Guess, free: bool = False
) -> tuple[float, float, Look] | None:
    """Disc fit against a wall of one level, the median of the patch's rim: (x, y, looks) or None.

    `free`: radius and edge are fitted too; else the edge is widened, to find the bob from far away.
    """
    patch = cut(frame, sight, guess.x_px, guess.y_px, 1.6 * look.radius_px + 6)
    if patch is None:
        return None
    rim = np.concatenate([patch.image[0], patch.image[-1], patch.image[:, 0], patch.image[:, -1]])
    level = max(float(np.median(rim)), 1.0)
    patch = patch._replace(back=np.full_like(patch.image, level), seen=np.zeros_like(patch.image))
    how: dict[str, Any] = {"calibrate": True, "turns": 8} if free else {"soften": 2.5, "turns": 12}
    if free and look.contrast == 0.0:
        how = {"calibrate": True, "turns": 12, "soften": 2.0}
    out = fit_disc(patch, look._replace(noise=np.inf), guess, **how)
    if out is None or abs(out[9]) < 4:
        return None
    return out[0] + patch.x_px, out[1] + patch.y_px, Look(out[2], out[3], out[9], out[7])


def cut(frame: Frame, sight: Sight, x: float, y: float, half: float) -> Patch | None:
    """The patch of ±half px about (x, y), as far as it lies in the picture (`back` and `seen` are yet to be set)."""
    if not np.isfinite(x + y + half):
        return None
    height, width = frame.luma.shape
    x0, x1 = max(0, int(x - half)), min(width, int(x + half) + 2)
    y0, y1 = max(0, int(y - half)), min(height, int(y + half) + 2)
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
