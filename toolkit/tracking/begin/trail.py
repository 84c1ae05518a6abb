"""One hypothesis followed through the frames read ahead, both ways from where it was seen."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import hypot, isfinite
from typing import Any, NamedTuple

import numpy as np

from toolkit.trackers.disc import fit_disc
from toolkit.trackers.localiser import Guess, Look, Patch
from toolkit.tracking.begin.search import Hypothesis, find_round_near
from toolkit.tracking.geometry.swing import Swing, fit_swing, start_swing
from toolkit.tracking.picture.plane import rim_level, silhouette
from toolkit.tracking.picture.sight import LUMA, Sight
from toolkit.video import Frame

_RESTS = 0.05  # of the radius: what moves less from one frame to the next may stand still
_CHANGES, _MOSTLY = 0.25, 0.5  # of the contrast, and of a disc: what changes less shows the same as before
_ABOUT_PX = 3.0  # beyond its outline's softness
_LOOKED_AT = 6  # frames on which it is slow


@dataclass(frozen=True)
class Rough:
    """A hypothesis that was followed: the bob's looks, its motion, centre by index of the frame, and a score; and where another thing
    was seen that swings too."""

    look: Look
    swing: Swing
    points: dict[int, tuple[float, float]]
    score: float
    sight: Sight
    rival_px: tuple[float, float] | None = None

    @property
    def clearness(self) -> float:
        """The score that its looks alone would give."""
        return _score(self.look, 0.0)


class Stage(NamedTuple):
    """The still picture that hypotheses are followed before; with `silhouette` all that differs from it looks alike."""

    still: np.ndarray
    silhouette: bool


@dataclass
class Trail:
    """Where a thing that looks so was seen, by the index of the frame; against a wall of one level, or on a stage.

    look : as it was where it was seen first.    looks : as it was on every frame of `points`.
    repeated : frames that show the one before once more.    still : where it was taken for something that stands still.
    """

    batch: list[Frame]
    sight: Sight
    stage: Stage | None
    repeated: frozenset[int]
    look: Look
    points: dict[int, tuple[float, float]]
    looks: list[Look] = field(default_factory=list)
    still: dict[int, tuple[float, float]] = field(default_factory=dict)

    def _at(self, i: int) -> tuple[float, float] | None:
        """Where on frame i it is, or something like it that stands still."""
        return self.points.get(i, self.still.get(i))

    def holds(self, h: Hypothesis, start: int) -> bool:
        """Is the hypothesis on what was followed here?"""
        place = self._at(start)
        return (
            place is not None
            and bool(np.hypot(place[0] - h.x_px, place[1] - h.y_px) < 0.7 * self.look.radius_px)
            and h.radius_px < 1.5 * self.look.radius_px
        )

    def meets(self, other: Trail) -> bool:
        """Does the other one begin on what was followed here, and does it look the same?"""
        (start, (x, y)), look = next(iter(other.points.items())), other.look
        place = self._at(start)
        return (
            place is not None
            and hypot(place[0] - x, place[1] - y) < 0.2 * self.look.radius_px
            and _alike(look, self.look)
        )

    @property
    def hope(self) -> float:
        """The score that it may have, followed, if it looks everywhere as it did where it was seen first."""
        return _score(self.look, 0.0)

    def follow(self, radius: float | None) -> Rough | None:
        """Through all frames, from the first point on; None unless it swings. `radius` if it is known, px."""
        start = next(iter(self.points))
        for way in (1, -1):
            self._go(start, way)
        self._leave_out_still()
        swing = self._fill_gaps()
        if self._leave_out_still():
            swing = swing_through(self.batch, self.points, self.look)
        if swing is None or len(self.points) < max(12, 0.3 * len(self.batch)):
            return None
        size, edge, contrast, noise = (float(np.median([k[n] for k in self.looks])) for n in range(4))
        # on most frames: a string that passes before what stands still moves it about on a few
        extent = float(np.hypot(*np.ptp(np.percentile(list(self.points.values()), (10, 90), axis=0), axis=0)))
        size = radius or size
        moved = min(1.0, 0.25 * extent / size)  # what stands still on a wall that shakes explains little change
        share = len(self.points) / len(self.batch)
        score = share**2 * moved * self._bounded() ** 2 * _score(Look(size, edge, contrast, noise), swing.rms_px)
        if self.stage is not None and self.stage.silhouette:
            contrast = _contrast(self.batch, self.points, size, self.stage.still)
        points = {i: self.points[i] for i in sorted(self.points)}
        return Rough(Look(size, edge, contrast, noise), swing, points, score, self.sight)

    def _go(self, start: int, way: int) -> None:
        """From one frame to the next, until it was missed on four."""
        recent = [(self.batch[start].t_s, *self.points[start])]
        misses, i = 0, start + way
        while 0 <= i < len(self.batch) and misses < 4:
            if i not in self.repeated:
                t = self.batch[i].t_s
                speed = np.hypot(recent[-1][1] - recent[-2][1], recent[-1][2] - recent[-2][2]) if recent[1:] else 0.0
                step = min(float(speed), 4 * self.look.radius_px)
                if self._take(i, Guess(*extrapolate(recent, t))) or self._look_around(i, *recent[-1][1:], step):
                    recent = [*recent, (t, *self.points[i])][-3:]
                    misses = 0
                else:
                    misses += 1
            i += way

    def _leave_out_still(self) -> bool:
        """Leave out where it neither moves nor covers anything: that is something like it which stands there, and held what came
        by. Was there any?"""
        rests = _RESTS * self.look.radius_px
        still = {i for i, step in self._steps().items() if step < rests and self._change(i)[0] < _MOSTLY}
        if still:
            self.looks = [look for i, look in zip(self.points, self.looks) if i not in still]
            self.still |= {i: self.points.pop(i) for i in still}
        return bool(still)

    def _bounded(self) -> float:
        """How much of what is about it stands still, where it is slow: a highlight or a spot has the rest of the bob about it."""
        steps = self._steps()
        slow = sorted(steps, key=lambda i: steps[i])[: max(_LOOKED_AT, len(steps) // 4)]
        return 1.0 - float(np.median([self._change(i)[1] for i in slow[:: max(1, len(slow) // _LOOKED_AT)]]))

    def _steps(self) -> dict[int, float]:
        """How far it moves (px) from one point to the next: the longer of the two steps beside each."""
        numbers = sorted(self.points)
        step = np.hypot(*np.diff([self.points[i] for i in numbers], axis=0).T) if len(numbers) > 1 else np.zeros(0)
        longer = np.maximum(np.append(step, 0.0), np.insert(step, 0, 0.0))
        return dict(zip(numbers, longer.tolist()))

    def _change(self, i: int) -> tuple[float, float]:
        """Which part of what is there on frame i, and of what is just beyond the outline, is another than where it is farthest away."""
        (x, y), look = self.points[i], self.look
        other = max(self.points, key=lambda k: hypot(self.points[k][0] - x, self.points[k][1] - y))
        near = look.radius_px + 2 * look.edge_px + 1
        half = near + _ABOUT_PX
        here, there = (cut(self.batch[k], self.sight, x, y, half) for k in (i, other))
        if here is None or there is None:
            return 1.0, 0.0
        light = 1.0
        if self.sight.weights == LUMA:
            bright, before = (float(self.batch[k].luma[::16, ::16].mean()) for k in (i, other))
            light = bright / max(before, 1.0)
        if self.stage is not None and self.stage.silhouette:
            differs = silhouette(here.image, there.image) > _CHANGES * look.contrast
        else:
            differs = np.abs(here.image - light * there.image) > _CHANGES * abs(look.contrast)
        rows, columns = np.ogrid[: differs.shape[0], : differs.shape[1]]
        far = np.hypot(columns + here.x_px - x, rows + here.y_px - y)
        within, beyond = differs[far < 0.7 * look.radius_px], differs[(far > near) & (far < half)]
        return float(np.mean(within)) if within.size else 1.0, float(np.mean(beyond)) if beyond.size else 0.0

    def _fill_gaps(self) -> Swing | None:
        """What lies behind a gap, where the motion says; the motion through all that was seen."""
        swing = swing_through(self.batch, self.points, self.look)
        tried: set[int] = set()
        while swing is not None and len(self.points) < len(self.batch):
            known = self.points.keys() | tried | self.repeated
            left = [i for i in range(len(self.batch)) if i not in known]
            if not left:
                break
            near = [i for i in left if min(abs(i - p) for p in self.points) <= 24] or left[:1]
            where = swing.position(np.array([self.batch[i].t_s for i in near]))
            tried.update(near)
            if sum([self._take(i, Guess(float(x), float(y))) for i, x, y in zip(near, *where)]):
                swing = swing_through(self.batch, self.points, self.look)
        return swing

    def _take(self, i: int, guess: Guess) -> bool:
        """Add the point of frame i, if something like it is near the guess."""
        fit = self._fit(i, guess)
        if fit is None or not 0.7 < fit[2].radius_px / self.look.radius_px < 1.4:
            return False
        if not 0.4 < fit[2].contrast / self.look.contrast < 2.0:
            return False
        if np.hypot(fit[0] - guess.x_px, fit[1] - guess.y_px) > 0.8 * self.look.radius_px + 3:
            return False
        self.points[i] = fit[:2]
        self.looks.append(fit[2])
        return True

    def _fit(self, i: int, guess: Guess) -> tuple[float, float, Look] | None:
        look = self.look
        if self.stage is not None and self.stage.silhouette:
            patch = _on_stage(self.batch[i], self.sight, guess.x_px, guess.y_px, 2.2 * look.radius_px + 6, self.stage)
            found = None if patch is None else find_round_near(patch.image, look.radius_px, 1, look.edge_px)
            if patch is None or found is None or found[2] < 0.5:
                return None
            return found[0] + patch.x_px, found[1] + patch.y_px, look
        close = rough_fit(self.batch[i], self.sight, look, guess, self.stage, free=True)
        if close is not None and self._is_it(close, guess):
            return close
        wide = rough_fit(self.batch[i], self.sight, look, guess, self.stage)
        # where a wide look does not settle (a highlight on a streaked bob) a close one may
        near = guess if wide is None else Guess(wide[0], wide[1])
        return rough_fit(self.batch[i], self.sight, look, near, self.stage, free=True)

    def _is_it(self, fit: tuple[float, float, Look], guess: Guess) -> bool:
        """Just where it was to be, and just as it was: it need not be looked for from farther away."""
        x, y, seen = fit
        look = self.look
        return (
            hypot(x - guess.x_px, y - guess.y_px) < 0.25 * look.radius_px
            and _alike(seen, look)
            and seen.noise < 1.25 * look.noise + 0.5
        )

    def _look_around(self, i: int, x: float, y: float, step: float) -> bool:
        """Not where it should be: the outline of its size that gathers most votes within some diameters and `step`s."""
        look = self.look
        patch = _on_stage(self.batch[i], self.sight, x, y, 5.5 * look.radius_px + 4 + 2 * step, self.stage)
        if patch is None:
            return False
        found = find_round_near(patch.image - patch.back, look.radius_px, 1 if look.contrast > 0 else -1, look.edge_px)
        if found is None or found[2] < 0.5:
            return False
        return self._take(i, Guess(found[0] + patch.x_px, found[1] + patch.y_px))


def _alike(one: Look, other: Look) -> bool:
    """Are size and contrast of two things about the same?"""
    return 0.9 < one.radius_px / other.radius_px < 1.1 and 0.8 < one.contrast / other.contrast < 1.25


def _score(look: Look, rms_px: float) -> float:
    """How clear, large and calm a thing is that moves far and is seen on all frames."""
    return abs(look.contrast) / (look.noise + 1.0) * look.radius_px**0.5 / (0.3 + rms_px)


def begin_trail(
    batch: list[Frame],
    start: int,
    h: Hypothesis,
    sight: Sight,
    radius: float | None,
    repeated: frozenset[int],
    stage: Stage | None = None,
) -> Trail | None:
    """A trail with its first point, on frame `start`; None where nothing like the hypothesis is there."""
    guessed = Look(h.radius_px, max(0.8, 0.12 * h.radius_px))
    first = rough_fit(batch[start], sight, guessed, Guess(h.x_px, h.y_px), stage, free=True)
    if first is None or not (radius or 0.4 < first[2].radius_px / h.radius_px < 2.2):
        return None
    return Trail(batch, sight, stage, repeated, first[2], {start: first[:2]}, [first[2]])


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


def swing_through(batch: list[Frame], points: dict[int, tuple[float, float]], look: Look) -> Swing | None:
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
    if not isfinite(x + y + half + half_y):
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
