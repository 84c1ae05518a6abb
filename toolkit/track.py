"""From a video to the bob's position on every frame, with an error bar, and no click in ordinary clips."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import chain, pairwise
from pathlib import Path
from typing import Any

import numpy as np

from toolkit.background import Background
from toolkit.errors import JobError, UsageError
from toolkit.output import whole_file
from toolkit.progress import Progress, silent
from toolkit.search import Hypothesis, find_round_movers, shrink
from toolkit.swing import Swing, fit_swing, start_swing
from toolkit.trackers import load_tracker
from toolkit.trackers.disc import fit_disc
from toolkit.trackers.localiser import NOWHERE, Guess, Localiser, Look, Patch, Place
from toolkit.video import Frame, Video, clock_warnings, open_video

OK, PREDICTED, LOST = "ok", "predicted", "lost"


@dataclass(frozen=True)
class Track:
    """Where the bob was. All arrays have one entry a decoded frame.

    frame : (n,) int, decoded frames from 0.    t_s : (n,) true time stamps in s, first frame used at 0.
    x_px, y_px : (n,) bob centre in that frame's own pixels (first pixel's centre is (0, 0), y down); NaN if lost.
    sigma_x_px, sigma_y_px : (n,) standard uncertainties; NaN if lost.
    status : (n,) str, `ok` (measured), `predicted` (hidden: from the motion) or `lost`.
    radius_px : the bob's radius.    pivot_px : (x, y) of the pivot, may lie outside the picture.
    pivot_sigma_px : its standard uncertainties.    localiser : the tracker that measured most frames.
    meta : source, width_px, height_px, fps, time_source, log (sentences), warnings (sentences) and what else
        the stages after may use (string direction on each frame, exposure_s, velocities …).
    """

    frame: np.ndarray
    t_s: np.ndarray
    x_px: np.ndarray
    y_px: np.ndarray
    sigma_x_px: np.ndarray
    sigma_y_px: np.ndarray
    status: np.ndarray
    radius_px: float
    pivot_px: tuple[float, float]
    pivot_sigma_px: tuple[float, float]
    localiser: str
    meta: Mapping[str, Any] = field(default_factory=dict)

    @property
    def ok(self) -> np.ndarray:
        """(n,) bool: the frames on which the bob was measured."""
        return self.status == OK


def track(
    video_path: str | Path,
    *,
    pivot: tuple[float, float] | None = None,
    bob: tuple[float, float] | None = None,
    radius: float | None = None,
    start_s: float | None = None,
    stop_s: float | None = None,
    fps_factor: float = 1.0,
    localiser: str | None = None,
    progress: Progress = silent,
) -> Track:
    """Follow the bob of the pendulum in a video file or a folder of pictures.

    pivot, bob (on the first frame used) and radius are in px and only help where the search would fail.
    start_s, stop_s cut the clip (in the file's time); fps_factor is true frame rate / the file's (slow motion: > 1).
    localiser names the tracker to use; by default the one whose model fits the clip best.

    Raises JobError where the video cannot be read, or where nothing in it moves like a pendulum.
    """
    if not (np.isfinite(fps_factor) and fps_factor > 0):
        raise UsageError(f"fps_factor must be a positive number, got {fps_factor}")
    if radius is not None and not radius > 0:
        raise UsageError(f"radius must be positive, got {radius}")
    video = open_video(video_path)
    used = _between(iter(video), start_s, stop_s)
    job = _Job(video, pivot, bob, radius, localiser)
    progress("searching", 0.0)
    batch = _read_ahead(used)
    _require_frames(batch, video)
    job.begin(batch)
    expected = _expected_frames(video, start_s, stop_s)
    for frame in chain(batch, used):
        job.follow(frame)
        if job.count % 64 == 0:
            progress("tracking", min(1.0, job.count / expected))
    progress("tracking", 1.0)
    return job.finish(fps_factor)


def write_track_csv(track: Track, path: str | Path) -> None:
    """Write track.csv: frame,t_s,x_px,y_px,sigma_x_px,sigma_y_px,status and where measured the string's direction."""
    with whole_file(path) as scratch, scratch.open("w", encoding="utf-8", newline="\n") as file:
        file.write("frame,t_s,x_px,y_px,sigma_x_px,sigma_y_px,status\n")
        columns = zip(track.frame, track.t_s, track.x_px, track.y_px, track.sigma_x_px, track.sigma_y_px, track.status)
        for frame, t, x, y, sx, sy, status in columns:
            numbers = ",".join(
                "" if not np.isfinite(v) else f"{v:.6g}" if v in (sx, sy) else f"{v:.5f}" for v in (x, y, sx, sy)
            )
            file.write(f"{frame},{t:.9g},{numbers},{status}\n")


# --- the pieces ---------------------------------------------------------------------------------------------------

_REMEDY = "give --bob X,Y (its centre in px on the first frame)"


def _between(frames: Iterator[Frame], start_s: float | None, stop_s: float | None) -> Iterator[Frame]:
    for frame in frames:
        if stop_s is not None and frame.t_s > stop_s:
            return
        if start_s is None or frame.t_s >= start_s:
            yield frame


def _expected_frames(video: Video, start_s: float | None, stop_s: float | None) -> int:
    try:
        length = float(video.metadata.get("duration_s", "nan"))
    except ValueError:
        length = float("nan")
    stop = min(x for x in (stop_s, length, 1e9) if x is not None and x == x)  # noqa: PLR0124
    return max(1, int((stop - (start_s or 0.0)) * (video.fps_header or 30.0))) if stop < 1e9 else 1000


def _read_ahead(frames: Iterator[Frame], most_s: float = 1.6, most_bytes: float = 2.2e8) -> list[Frame]:
    """The first frames, kept in memory: the search looks at these, so that the file is decoded only once."""
    batch: list[Frame] = []
    size = 0.0
    for frame in frames:
        batch.append(frame)
        size += 1.5 * frame.luma.size
        if len(batch) >= 24 and (size > most_bytes or frame.t_s - batch[0].t_s > most_s):
            break
    return batch


def _require_frames(batch: list[Frame], video: Video) -> None:
    if not batch:
        raise JobError(f"no frame of {video.path} lies in the time asked for; change --start and --stop")
    if len(batch) == 1:
        raise JobError(f"{video.path} holds a single frame; a pendulum needs a video of at least half a period")
    if len(batch) < 8:
        raise JobError(f"{video.path} holds only {len(batch)} frames; film at least half a period")


@dataclass
class _Job:
    """The state of one tracking run: what the bob looks like, where it was, what hides behind it."""

    video: Video
    pivot: tuple[float, float] | None
    bob: tuple[float, float] | None
    radius: float | None
    wanted: str | None
    log: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    count: int = 0

    # --- search ---------------------------------------------------------------------------------------------------

    def begin(self, batch: list[Frame]) -> None:
        """Find the bob in the frames read ahead, learn its looks and the background, choose the localiser."""
        self.shape = batch[0].luma.shape
        self.localiser: Localiser = load_tracker(self.wanted or "disc")
        hypotheses, samples = self._hypotheses(batch)
        best: tuple[float, _Rough] | None = None
        for h in hypotheses:
            rough = self._follow_roughly(batch, samples[h.sample], h)
            if rough is not None:
                score = rough.score
                if best is None or score > best[0]:
                    best = (score, rough)
                if self.bob is not None:
                    break
        if best is None:
            if not hypotheses:
                raise JobError(
                    f"nothing that moves was found in {self.video.path}; film the swinging bob, or {_REMEDY}"
                )
            raise JobError(f"nothing in {self.video.path} moves like a pendulum; if there is one, {_REMEDY}")
        rough = best[1]
        self.look, self.swing = rough.look, rough.swing
        self._learn(batch, rough)
        n = 0
        self.t, self.x, self.y = [], [], []
        self.sx, self.sy, self.state, self.index, self.misfit, self.visible = [], [], [], [], [], []
        self.hidden = n
        self.recent: deque[tuple[float, float, float]] = deque(maxlen=4)

    def _hypotheses(self, batch: list[Frame]) -> tuple[list[Hypothesis], list[int]]:
        samples = sorted({round(i) for i in np.linspace(0, len(batch) - 1, 16)})
        if self.bob is not None:
            x, y = self.bob
            if not (0 <= x < self.shape[1] and 0 <= y < self.shape[0]):
                raise UsageError(f"bob ({x:g}, {y:g}) lies outside the picture of {self.shape[1]}×{self.shape[0]} px")
            radii = [self.radius] if self.radius else [r for r in (20.0, 12.0, 30.0, 8.0, 45.0, 5.0, 70.0)]
            return [Hypothesis(0, x, y, r, 0, 1.0) for r in radii], samples
        factor = max(1, round(self.shape[1] / 420))
        pictures = [shrink(batch[i].luma, factor) for i in samples]
        found = find_round_movers(pictures, factor)
        if self.radius:
            found = [h._replace(radius_px=self.radius) for h in found]
        return found, samples

    def _follow_roughly(self, batch: list[Frame], start: int, h: Hypothesis) -> _Rough | None:
        """Follow a hypothesis through the frames read ahead without knowing the background."""
        look = Look(h.radius_px, max(0.8, 0.12 * h.radius_px))
        first = self._flat_fit(batch[start], look, Guess(h.x_px, h.y_px), calibrate=True, soften=2.0, turns=10)
        if first is None:
            return None
        x, y, look = first
        if not (self.radius or 0.4 < look.radius_px / h.radius_px < 2.2):
            return None
        points = {start: (x, y)}
        looks = [look]
        for way in (1, -1):
            recent = [(batch[start].t_s, x, y)]
            misses = 0
            i = start + way
            while 0 <= i < len(batch) and misses < 4:
                gx, gy = _extrapolate(recent, batch[i].t_s)
                fit = self._flat_fit(batch[i], look, Guess(gx, gy), calibrate=False, soften=2.5, turns=12)
                if fit is not None:
                    fit = self._flat_fit(batch[i], look, Guess(fit[0], fit[1]), calibrate=True, turns=6)
                alike = fit is not None and (
                    0.7 < fit[2].radius_px / look.radius_px < 1.4 and 0.4 < fit[2].contrast / look.contrast < 2.0
                )
                if fit is not None and alike:
                    points[i] = fit[:2]
                    looks.append(fit[2])
                    recent = [*recent, (batch[i].t_s, *fit[:2])][-3:]
                    misses = 0
                else:
                    misses += 1
                i += way
        if len(points) < max(8, 0.5 * len(batch)):
            return None
        order = sorted(points)
        t = np.array([batch[i].t_s for i in order])
        px = np.array([points[i] for i in order])
        radius = self.radius or float(np.median([k.radius_px for k in looks]))
        look = Look(
            radius,
            float(np.median([k.edge_px for k in looks])),
            float(np.median([k.contrast for k in looks])),
            float(np.median([k.noise for k in looks])),
        )
        extent = float(np.hypot(*np.ptp(px, axis=0)))
        if extent < max(1.0, 0.05 * radius):
            return None  # it does not move
        begin = start_swing(t, px[:, 0], px[:, 1])
        swing = None
        if begin is not None:
            swing = fit_swing(t, px[:, 0], px[:, 1], np.full(t.size, 0.3), begin)
        if swing is None or swing.rms_px > max(0.05 * extent, 0.5):
            return None
        quality = abs(look.contrast) / (look.noise + 1.0)
        score = len(points) / len(batch) * quality * radius**0.5 / (0.3 + swing.rms_px)
        return _Rough(look, swing, {i: points[i] for i in order}, score)

    def _flat_fit(self, frame: Frame, look: Look, guess: Guess, **how: Any) -> tuple[float, float, Look] | None:
        """Disc fit against a wall of one level (the median of the patch's rim)."""
        patch = self._cut(frame, guess, 1.6 * look.radius_px + 6)
        if patch is None:
            return None
        rim = np.concatenate([patch.image[0], patch.image[-1], patch.image[:, 0], patch.image[:, -1]])
        level = float(np.median(rim))
        patch = patch._replace(back=np.full_like(patch.image, max(level, 1.0)), seen=np.zeros_like(patch.image))
        out = fit_disc(patch, look._replace(noise=np.inf), guess, **how)
        if out is None or abs(out[9]) < 4:
            return None
        x, y = out[0] + patch.x_px, out[1] + patch.y_px
        return x, y, Look(out[2], out[3], out[9], out[7])

    def _cut(self, frame: Frame, guess: Guess, half: float) -> Patch | None:
        """The patch of ±half px about the guess, as far as it lies in the picture."""
        if not (np.isfinite(guess.x_px) and np.isfinite(guess.y_px)):
            return None
        x0, x1 = max(0, int(guess.x_px - half)), min(self.shape[1], int(guess.x_px + half) + 2)
        y0, y1 = max(0, int(guess.y_px - half)), min(self.shape[0], int(guess.y_px + half) + 2)
        if x1 - x0 < 6 or y1 - y0 < 6:
            return None
        image = frame.luma[y0:y1, x0:x1].astype(np.float32)
        return Patch(image, image, image, x0, y0)

    # --- learning -------------------------------------------------------------------------------------------------

    def _learn(self, batch: list[Frame], rough: _Rough) -> None:
        """Background from all frames read ahead, then radius, edge and exposure from fits against it."""
        self.back = Background(self.shape)
        pivot = self.pivot or rough.swing.pivot_px
        xs, ys = np.array(list(rough.points.values())).T
        grow = 3 * rough.look.radius_px + 20
        box = (
            max(0, int(xs.min() - grow)),
            max(0, int(ys.min() - grow)),
            min(self.shape[1], int(xs.max() + grow)),
            min(self.shape[0], int(ys.max() + grow)),
        )
        every = max(1, len(batch) // 40)
        for i, (x, y) in rough.points.items():
            if i % every == 0:
                piece = batch[i].luma[box[1] : box[3], box[0] : box[2]]
                keep_out = 1.1 * rough.look.radius_px + 2 * rough.look.edge_px + 2
                self.back.add(piece, box, (x, y, keep_out), pivot)
        self.back.fill_gaps(box)
        times = np.array([batch[i].t_s for i in rough.points])
        vx, vy = rough.swing.velocity(times)
        speed = np.hypot(vx, vy)
        interval = float(np.median(np.diff([f.t_s for f in batch])))
        look = rough.look
        numbers = list(rough.points)
        # radius and edge where it is slow
        slow = np.argsort(speed)[: max(6, len(numbers) // 4)]
        fits = []
        for k in slow[:16]:
            i = numbers[k]
            fit = self._fine(batch[i], look, self._guess(*rough.points[i], 0.0, 0.0), calibrate=True, turns=6)
            if fit is not None:
                fits.append(fit)
        if len(fits) >= 3:
            middle = np.median(np.array(fits), axis=0)
            look = Look(self.radius or middle[2], max(0.35, middle[3]), middle[9], middle[7])
        # exposure where it is fast: the streak that fits best
        self.exposure_s = 0.0
        fast = [numbers[k] for k in np.argsort(-speed)[:8]]
        if speed.max() * interval > 1.0:
            trials = np.linspace(0, 1, 11)
            cost = np.zeros(trials.size)
            for i in fast:
                ux, uy = (v[numbers.index(i)] * interval for v in (vx, vy))
                for j, part in enumerate(trials):
                    fit = self._fine(batch[i], look, self._guess(*rough.points[i], part * ux, part * uy), turns=4)
                    cost[j] += np.inf if fit is None else fit[7] ** 2
            if np.isfinite(cost).sum() > 2:
                j = int(np.argmin(cost))
                part = trials[j]
                if 0 < j < trials.size - 1 and np.all(np.isfinite(cost[j - 1 : j + 2])):
                    a, b, c = cost[j - 1 : j + 2]
                    part += 0.1 * 0.5 * (a - c) / max(a - 2 * b + c, 1e-12)
                self.exposure_s = float(max(0.0, part) * interval)
        self.look = look
        self.interval_s = interval

    def _guess(self, x: float, y: float, bx: float, by: float) -> Guess:
        px, py = self.pivot or self.swing.pivot_px
        return Guess(x, y, bx, by, float(np.arctan2(py - y, px - x)))

    def _patch(self, frame: Frame, look: Look, guess: Guess) -> Patch | None:
        half = 1.25 * look.radius_px + 4 * look.edge_px + 4 + 0.5 * np.hypot(guess.streak_x_px, guess.streak_y_px)
        patch = self._cut(frame, guess, half)
        if patch is None:
            return None
        rows, columns = patch.image.shape
        window = (slice(patch.y_px, patch.y_px + rows), slice(patch.x_px, patch.x_px + columns))
        return patch._replace(back=self.back.mean[window], seen=self.back.seen[window])

    def _fine(self, frame: Frame, look: Look, guess: Guess, **how: Any) -> np.ndarray | None:
        patch = self._patch(frame, look, guess)
        if patch is None:
            return None
        out = fit_disc(patch, look, guess, **how)
        if out is not None:
            out[0] += patch.x_px
            out[1] += patch.y_px
        return out

    # --- following ------------------------------------------------------------------------------------------------

    def follow(self, frame: Frame) -> None:
        """Measure one frame, in the order of the file."""
        t = frame.t_s
        x, y, vx, vy = self._expect(t)
        guess = self._guess(x, y, vx * self.exposure_s, vy * self.exposure_s)
        patch = self._patch(frame, self.look, guess)
        place = NOWHERE
        if patch is not None:
            if self.hidden or len(self.recent) < 3:
                wide = fit_disc(patch, self.look._replace(noise=np.inf), guess, soften=2.5, turns=10)
                if wide is not None:
                    guess = guess._replace(x_px=wide[0] + patch.x_px, y_px=wide[1] + patch.y_px)
            place = self.localiser.locate(patch, self.look, guess)
            if not np.isfinite(place.x_px):
                wide = fit_disc(patch, self.look._replace(noise=np.inf), guess, soften=3.0, turns=12)
                if wide is not None:
                    near = guess._replace(x_px=wide[0] + patch.x_px, y_px=wide[1] + patch.y_px)
                    place = self.localiser.locate(patch, self.look, near)
        ok = self._accept(place, x, y)
        self.index.append(frame.index)
        self.t.append(t)
        self.state.append(OK if ok else LOST)
        self.x.append(place.x_px if ok else np.nan)
        self.y.append(place.y_px if ok else np.nan)
        self.sx.append(place.sigma_x_px if ok else np.nan)
        self.sy.append(place.sigma_y_px if ok else np.nan)
        self.misfit.append(place.misfit)
        self.visible.append(place.visible)
        if ok and patch is not None:
            self.hidden = 0
            self.recent.append((t, place.x_px, place.y_px))
            rows, columns = patch.image.shape
            box = (patch.x_px, patch.y_px, patch.x_px + columns, patch.y_px + rows)
            streak = 0.5 * np.hypot(guess.streak_x_px, guess.streak_y_px)
            keep_out = 1.05 * self.look.radius_px + 3 * self.look.edge_px + 1 + streak
            self.back.add(patch.image, box, (place.x_px, place.y_px, keep_out), self.pivot or self.swing.pivot_px)
        else:
            self.hidden += 1
            if self.hidden == 2:
                self._refit()
        self.count += 1

    def _accept(self, place: Place, x: float, y: float) -> bool:
        look = self.look
        if not np.isfinite(place.x_px):
            return False
        return bool(
            place.visible >= 0.85
            and place.misfit < 3 * look.noise + 0.03 * abs(look.contrast)
            and 0.6 < place.contrast / look.contrast < 1.6
            and np.hypot(place.x_px - x, place.y_px - y) < 0.6 * look.radius_px + 2
        )

    def _expect(self, t: float) -> tuple[float, float, float, float]:
        """Where the bob should be at time t and how fast, px and px/s."""
        recent = list(self.recent)[-3:]
        if self.hidden < 2 and len(recent) == 3 and t - recent[0][0] < 6 * self.interval_s:
            x, y = _extrapolate(recent, t)
            x1, y1 = _extrapolate(recent, t + 0.5 * self.interval_s)
            x0, y0 = _extrapolate(recent, t - 0.5 * self.interval_s)
            return x, y, (x1 - x0) / self.interval_s, (y1 - y0) / self.interval_s
        px, py = self.swing.position(np.array([t]))
        vx, vy = self.swing.velocity(np.array([t]))
        return float(px[0]), float(py[0]), float(vx[0]), float(vy[0])

    def _refit(self) -> None:
        """Fit the motion to what was measured last, to see through a gap."""
        good = np.isfinite(self.x)
        if good.sum() < 20:
            return
        t, x, y = (np.array(v)[good][-600:] for v in (self.t, self.x, self.y))
        start = self._restarted(t[0])
        swing = fit_swing(t, x, y, np.full(t.size, 0.1), start)
        if swing is not None and swing.rms_px < 0.25 * self.look.radius_px + 1:
            self.swing = swing

    def _restarted(self, t0: float) -> np.ndarray:
        theta, rate = self.swing.angle(np.array([t0]))
        values = self.swing.values.copy()
        values[7:] = theta[0], rate[0]
        return values

    # --- the end --------------------------------------------------------------------------------------------------

    def finish(self, fps_factor: float) -> Track:
        """Judge the whole motion, bridge the gaps, make σ true."""
        self.t = list(_even_times(np.array(self.t), self.video, self.log))
        t = np.array(self.t)
        t = t - t[0]
        x, y = np.array(self.x), np.array(self.y)
        sx, sy = np.array(self.sx), np.array(self.sy)
        status = np.array(self.state, dtype="U9")
        good = status == OK
        if good.sum() < max(8, 0.3 * good.size):
            raise JobError(
                f"the bob was seen on only {good.sum()} of {good.size} frames of {self.video.path}; {_REMEDY}"
            )
        t0 = self.t[0]
        swing = self._final_swing(t + t0, x, y, good)
        _require_pendulum(swing, t + t0, x, y, good, self.video.path)
        mx, my = swing.position(t + t0)
        scale = _true_sigma(x - mx, y - my, sx, sy, good)
        sx, sy = sx * scale[0], sy * scale[1]
        bridged = _bridged(good, t, swing.period_s)
        spread = float(np.hypot(np.nanstd((x - mx)[good]), np.nanstd((y - my)[good])))
        x[bridged], y[bridged] = mx[bridged], my[bridged]
        sx[bridged] = sy[bridged] = max(spread, 0.02)
        status[bridged] = PREDICTED
        steps = np.diff(t)
        fps = float(1 / np.median(steps[steps > 0])) * fps_factor if np.any(steps > 0) else float("nan")
        warnings = [*self.video.warnings, *clock_warnings(t, self.video), *self.warnings]
        log = [
            *self.log,
            (
                f"The bob was followed with the {self.localiser.name} localiser (radius {self.look.radius_px:.2f} px, "
                f"edge {self.look.edge_px:.2f} px, exposure {self.exposure_s / fps_factor * 1e3:.1f} ms): "
                f"{good.sum()} of {good.size} frames measured, {bridged.sum()} bridged by the fitted motion."
            ),
            (
                f"The error bars of the fit were multiplied by {scale[0]:.2f} (x) and {scale[1]:.2f} (y), "
                "the scatter seen about a smooth motion."
            ),
        ]
        return Track(
            frame=np.array(self.index),
            t_s=t / fps_factor,
            x_px=x,
            y_px=y,
            sigma_x_px=sx,
            sigma_y_px=sy,
            status=status,
            radius_px=float(self.look.radius_px),
            pivot_px=self.pivot or swing.pivot_px,
            pivot_sigma_px=(float(np.sqrt(swing.covariance[0, 0])), float(np.sqrt(swing.covariance[1, 1]))),
            localiser=self.localiser.name,
            meta={
                "source": str(self.video.path),
                "width_px": self.video.width_px,
                "height_px": self.video.height_px,
                "fps": fps,
                "fps_factor": fps_factor,
                "time_source": self.video.time_source,
                "exposure_s": self.exposure_s / fps_factor,
                "edge_px": float(self.look.edge_px),
                "contrast": float(self.look.contrast),
                "visible": np.array(self.visible),
                "misfit": np.array(self.misfit),
                "residual_rms_px": swing.rms_px,
                "swing": _at_first_measured(swing, t + t0, good, fps_factor),
                "log": log,
                "warnings": warnings,
            },
        )

    def _final_swing(self, t: np.ndarray, x: np.ndarray, y: np.ndarray, good: np.ndarray) -> Swing:
        chosen = np.flatnonzero(good)
        # in growing pieces, so that a small error of the period at the start does not lose count of the swings
        swing: Swing | None = None
        stop = t[chosen[0]] + max(1.5 * self.swing.period_s, 1.5)
        start = self._restarted(t[chosen[0]])
        while True:
            part = chosen[t[chosen] <= stop]
            if part.size >= 12:
                every = max(1, part.size // 1500)
                p = part[::every]
                swing = fit_swing(t[p], x[p], y[p], np.full(p.size, 0.1), start)
                if swing is None:
                    break
                start = swing.values
            if stop >= t[-1]:
                break
            stop = t[chosen[0]] + 2.5 * (stop - t[chosen[0]])
        if swing is None:
            raise JobError(
                f"what moves in {self.video.path} does not swing like a pendulum; if there is one, {_REMEDY}"
            )
        return swing


@dataclass(frozen=True)
class _Rough:
    look: Look
    swing: Swing
    points: dict[int, tuple[float, float]]
    score: float


def _extrapolate(recent: list[tuple[float, float, float]], t: float) -> tuple[float, float]:
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


def _require_pendulum(swing: Swing, t: np.ndarray, x: np.ndarray, y: np.ndarray, good: np.ndarray, path: Path) -> None:
    span = float(t[good][-1] - t[good][0])
    if span < 0.5 * swing.period_s:
        raise JobError(
            f"{path} shows {span:.2f} s, less than half a period ({0.5 * swing.period_s:.2f} s); film at least one period"
        )
    extent = float(np.hypot(np.ptp(x[good]), np.ptp(y[good])))
    amplitude = swing.amplitude_rad(t[good])
    reasons = []
    if swing.rms_px > max(0.04 * extent, 0.3):
        reasons.append(f"it strays {swing.rms_px:.1f} px from a swing of {extent:.0f} px")
    if not 0 < amplitude < np.pi:
        reasons.append("it does not turn back")
    if swing.values[5] * span < -0.5:
        reasons.append("its swing grows")
    if swing.values[4] <= 0:
        reasons.append("nothing pulls it back")
    if reasons:
        raise JobError(f"what moves in {path} is no pendulum ({reasons[0]}); if there is one, {_REMEDY}")


def _true_sigma(
    rx: np.ndarray, ry: np.ndarray, sx: np.ndarray, sy: np.ndarray, good: np.ndarray
) -> tuple[float, float]:
    """Factors that make the fit's σ agree with the scatter about the motion."""
    return tuple(float(np.sqrt(np.mean((r[good] / s[good]) ** 2))) for r, s in ((rx, sx), (ry, sy)))  # type: ignore[return-value]


def _even_times(t: np.ndarray, video: Video, log: list[str]) -> np.ndarray:
    """Time stamps that a file keeps only to the millisecond (Matroska, WebM), put back on their even grid.

    Only where every stamp agrees with one constant frame rate to within its rounding; else as they are.
    """
    tick = video.tick_s
    if tick < 2e-4 or t.size < 10:
        return t
    n = np.arange(t.size)
    rate = (t.size - 1) / (t[-1] - t[0]) if t[-1] > t[0] else 0.0
    claimed = video.fps_header
    if claimed and abs(claimed / max(rate, 1e-9) - 1) * t.size < 0.5 * (rate * tick) + 0.02 * rate * tick * t.size:
        rate = claimed
    if rate <= 0:
        return t
    grid = n / rate
    off = t - grid
    if np.ptp(off) > 1.05 * tick:
        return t
    log.append(
        f"The file keeps times to {tick * 1e3:.3g} ms only; all agree with {rate:.6g} frames per second, which was used."
    )
    return grid + 0.5 * (off.max() + off.min())


def _at_first_measured(swing: Swing, t: np.ndarray, good: np.ndarray, fps_factor: float) -> list[float]:
    """The fitted motion's values (the order of `toolkit.swing.NAMES`) with the state at the first measured frame."""
    theta, rate = swing.angle(t[good][:1])
    values = swing.values.copy()
    values[7:] = theta[0], rate[0] * fps_factor
    values[4] *= fps_factor**2
    values[5] *= fps_factor
    return [float(v) for v in values]


def _bridged(good: np.ndarray, t: np.ndarray, period_s: float) -> np.ndarray:
    """Frames between two measured ones that are less than a period apart."""
    seen = np.flatnonzero(good)
    bridged = np.zeros(good.size, bool)
    for a, b in pairwise(seen):
        if b - a > 1 and t[b] - t[a] < period_s:
            bridged[a + 1 : b] = True
    return bridged
