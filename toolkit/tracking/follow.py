"""The bob followed frame by frame: where it should be, where it is, whether to believe that."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field, replace
from math import cos, hypot, isfinite, sin

import numpy as np

from toolkit.trackers import load_tracker
from toolkit.trackers.disc import fit_disc
from toolkit.trackers.localiser import NOWHERE, Guess, Localiser, Look, Patch, Place
from toolkit.tracking.acquire import Rough, cut
from toolkit.tracking.background import Background
from toolkit.tracking.search import find_round_near
from toolkit.tracking.stillness import STILL, Anchors, CameraShift
from toolkit.tracking.string_line import measure_string
from toolkit.tracking.swing import Swing, fit_swing
from toolkit.video import Frame

_STRING_EVERY = 3
_CHECK_EVERY = 12
_TURN = np.arange(100) * np.pi * (3 - np.sqrt(5))  # a sunflower's places: even over the unit disc
_WITHIN = np.sqrt((np.arange(100) + 0.5) / 100) * np.stack([np.cos(_TURN), np.sin(_TURN)])


@dataclass
class Record:
    """What was measured, one entry a frame; positions in the first frame's pixels (those of a still camera)."""

    index: list[int] = field(default_factory=list)
    t_s: list[float] = field(default_factory=list)
    place: list[Place] = field(default_factory=list)
    ok: list[bool] = field(default_factory=list)
    repeated: list[bool] = field(default_factory=list)
    shift: list[CameraShift | None] = field(default_factory=list)
    string: dict[int, tuple[float, ...]] = field(default_factory=dict)


class Follower:
    """Follows one bob, given what was found in the frames read ahead.

    After construction `look`, `exposure_s`, `shaking` and `localiser` say what was learned; call `follow` with every
    frame in order and read `record`.
    """

    def __init__(
        self,
        batch: list[Frame],
        rough: Rough,
        pivot: tuple[float, float] | None,
        radius: float | None,
        wanted: str | None,
    ) -> None:
        self.shape = batch[0].luma.shape
        self.sight = rough.sight
        self.pivot = pivot
        self.swing = rough.swing
        self.record = Record()
        self.hidden = 0
        self.astray = 0.0  # how far the bob was from the fitted motion lately, px
        self._fitted_at = 0
        self._shade = np.nan  # the bob's own brightness lately, and how much it changes
        self._shade_scatter = 0.03 * abs(rough.look.contrast)
        self.first: list[Frame] = []  # the frames read ahead, if they are the first that will be followed
        self.recent: deque[tuple[float, float, float]] = deque(maxlen=3)
        self.interval_s = float(np.median(np.diff([f.t_s for f in batch]))) or 1 / 30
        self._print: np.ndarray | None = None
        points = self._learn_stillness(batch, rough)
        self._found = {batch[i].index: p for i, p in points.items()}
        self._learn_background(batch, rough.look, points)
        self.look, self.exposure_s = self._learn_looks(batch, rough.look, points, radius)
        if self.look.noise > 0.2 * abs(self.look.contrast):
            # what else there is beside the bob (a shadow) was fitted too, unless it must stand out as none of it
            strict = rough.look._replace(noise=0.05 * abs(rough.look.contrast) + 1.0)
            look, exposure_s = self._learn_looks(batch, strict, points, radius)
            if look.noise < 0.6 * self.look.noise:
                self.look, self.exposure_s = look, exposure_s
        self.ordinary_misfit = self.look.noise
        self.ordinary_visible = 0.85
        self.localiser: Localiser = self._choose(batch, points, wanted)

    # --- learning -------------------------------------------------------------------------------------------------

    def _learn_stillness(self, batch: list[Frame], rough: Rough) -> dict[int, tuple[float, float]]:
        """Does the camera move? Then the points found are put into the first frame's pixels and refitted."""
        import cv2

        moving = np.zeros(self.shape, np.uint8)
        pivot = self.pivot or rough.swing.pivot_px
        reach = int(2 * rough.look.radius_px + 10)
        for i, (x, y) in rough.points.items():
            cv2.circle(moving, (round(x), round(y)), reach, 1, -1)
            if i % 3 == 0:
                far = np.clip(pivot, -30000, 30000)
                cv2.line(moving, (round(x), round(y)), (round(far[0]), round(far[1])), 1, 44)
        self.anchors = Anchors(batch[0].luma, moving > 0)
        self.shaking = False
        self.checks: dict[int, CameraShift] = {}
        self._shifts: dict[int, CameraShift] = {}
        points = dict(rough.points)
        if len(self.anchors) == 0:
            return points
        probe = [self.anchors.shift(batch[i].luma) for i in range(0, len(batch), max(1, len(batch) // 12))]
        seen = [s for s in probe if s is not None]
        if len(seen) < 4:
            return points
        offs = np.array([(s.x_px, s.y_px) for s in seen])
        noise = float(np.median([s.sigma_px for s in seen]))
        if np.ptp(offs, axis=0).max() < max(0.25, 6 * noise):
            return points
        self.shaking = True
        last = STILL
        for frame in batch:
            last = self.anchors.shift(frame.luma) or last
            self._shifts[frame.index] = last
        for i, (x, y) in points.items():
            dx, dy = self._shifts[batch[i].index].at(x, y)
            points[i] = (x - dx, y - dy)
        t = np.array([batch[i].t_s for i in points])
        x, y = np.array(list(points.values())).T
        better = fit_swing(t, x, y, np.full(t.size, 0.3), _restarted(rough.swing, t[0]))
        self.swing = better or self.swing
        return points

    def _learn_background(self, batch: list[Frame], look: Look, points: dict[int, tuple[float, float]]) -> None:
        self.back = Background((self.shape[0], self.shape[1]))
        xs, ys = np.array(list(points.values())).T
        grow = 3 * look.radius_px + 20
        x0, y0 = max(0, int(xs.min() - grow)), max(0, int(ys.min() - grow))
        x1, y1 = min(self.shape[1], int(xs.max() + grow)), min(self.shape[0], int(ys.max() + grow))
        every = max(1, len(batch) // 40)
        pivot = self.pivot or self.swing.pivot_px
        for i, (x, y) in points.items():
            if i % every == 0:
                dx, dy = (round(v) for v in self._camera(batch[i]).at(x, y))
                a, b = max(x0, -dx), max(y0, -dy)
                c, d = min(x1, self.shape[1] - dx), min(y1, self.shape[0] - dy)
                if c - a < 4 or d - b < 4:
                    continue
                piece = self.sight.window(batch[i], a + dx, b + dy, c + dx, d + dy)
                self.back.add(piece, (a, b, c, d), (x, y, 1.1 * look.radius_px + 2 * look.edge_px + 2), pivot)
        self.back.fill_gaps((x0, y0, x1, y1))

    def _learn_looks(
        self, batch: list[Frame], look: Look, points: dict[int, tuple[float, float]], radius: float | None
    ) -> tuple[Look, float]:
        """Radius and edge from fits where the bob is slow, the exposure from the streak where it is fast."""
        numbers = np.array(list(points))
        vx, vy = self.swing.velocity(np.array([batch[i].t_s for i in numbers]))
        speed = np.hypot(vx, vy)
        found_px = look.radius_px

        def fit(k: int, look: Look, part: float, **how: bool | int) -> np.ndarray | None:
            i = numbers[k]
            guess = self._guess(*points[i], part * vx[k], part * vy[k])
            patch = self._patch(batch[i], look, guess)
            if patch is None:
                return None
            quiet.append(1.4826 * float(np.median(np.abs(patch.image - patch.back))))
            out = fit_disc(patch, look, guess, **how)  # type: ignore[arg-type]
            if out is not None and how.get("calibrate") and not radius:
                # half out of the picture, or a shadow taken for a part of it: no size to learn from
                x, y, size = out[0] + patch.x_px, out[1] + patch.y_px, float(out[2])
                rim = min(x, y, self.shape[1] - 1 - x, self.shape[0] - 1 - y)
                if rim < size + 2 or not 0.8 < size / found_px < 1.25:
                    return None
            return out

        quiet: list[float] = []  # the wall's own noise
        exposure = 0.0
        xs_middle = float(np.median([p[0] for p in points.values()]))
        for _ in range(2):  # the streak widens the edge, the edge shortens the streak
            slow = np.argsort(speed)[: max(8, numbers.size // 4)]
            slow = slow[:: max(1, slow.size // 16)][:16]
            found = [fit(k, look, exposure, calibrate=True, turns=8) for k in slow]
            fits = [f for f in found if f is not None]
            drawn = 0.05 * abs(look.contrast) + 1.5 * float(np.median(quiet or [0.0]))  # more misfit than noise leaves
            if look.even and fits and np.median([f[13] for f in fits]) > drawn:
                look = look._replace(even=False)  # a pattern or a highlight: the outline alone counts
                found = [fit(k, look, exposure, calibrate=True, turns=8) for k in slow]
                fits = [f for f in found if f is not None]
            if len(fits) >= 3:
                middle = np.median(np.array(fits), axis=0)
                size, edge, contrast, noise = (float(middle[n]) for n in (2, 3, 9, 7))
                look = Look(radius or size, max(0.35, edge), contrast, noise, even=look.even)
                left = np.array([points[numbers[k]][0] < xs_middle for k, f in zip(slow, found) if f is not None])
                sizes = np.array([f[2] for f in fits])
                if not radius and 3 <= left.sum() <= left.size - 3:
                    spread = np.hypot(
                        sizes[left].std() / np.sqrt(left.sum()), sizes[~left].std() / np.sqrt((~left).sum())
                    )
                    change = abs(sizes[left].mean() - sizes[~left].mean())
                    look = look._replace(radius_free=bool(change > max(0.05, 4 * spread)))
            if (
                not look.even and look.noise > drawn
            ):  # a pattern up to the outline: size and streak cannot be told by it
                return look._replace(radius_free=False), 0.0
            if speed.max() * self.interval_s < 1.0:
                break
            fast = np.argsort(-speed)[:6]
            trials = np.linspace(0, 1, 11)
            cost = np.zeros(trials.size)
            for j, part in enumerate(trials):
                for k in fast:
                    trial = fit(k, look, part * self.interval_s, turns=6)
                    cost[j] += np.inf if trial is None else trial[7] ** 2
            if not np.isfinite(cost).any():
                break
            j = int(np.argmin(cost))
            best = trials[j]
            if 0 < j < trials.size - 1 and np.all(np.isfinite(cost[j - 1 : j + 2])):
                a, b, c = cost[j - 1 : j + 2]
                best += 0.1 * 0.5 * (a - c) / max(a - 2 * b + c, 1e-12)
            exposure = float(max(0.0, best) * self.interval_s)
        return look, exposure

    def _choose(self, batch: list[Frame], points: dict[int, tuple[float, float]], wanted: str | None) -> Localiser:
        """The localiser asked for; else the disc fit where its model holds; else whichever scatters least about the
        motion. Also learns how large a misfit is ordinary for it."""
        names = [wanted] if wanted else ["disc"]
        if not wanted and (not self.look.even or self.look.noise > 0.05 * abs(self.look.contrast) + 2.5):
            names.append("edge")
        numbers = list(points)
        vx, vy = (v * self.exposure_s for v in self.swing.velocity(np.array([batch[i].t_s for i in numbers])))
        best, least = load_tracker(names[0]), np.inf
        for name in names:
            candidate = load_tracker(name)
            found = []
            for k, i in enumerate(numbers):
                guess = self._guess(*points[i], float(vx[k]), float(vy[k]))
                patch = self._patch(batch[i], self.look, guess)
                place = NOWHERE if patch is None else candidate.locate(patch, self.look, guess)
                if np.isfinite(place.x_px) and place.visible > 0.6:
                    found.append((batch[i].t_s, place.x_px, place.y_px, place.misfit, place.visible))
            if len(found) < max(10, 0.5 * len(points)):
                continue
            t, x, y, misfit, visible = np.array(found).T
            swing = fit_swing(t, x, y, np.full(t.size, 0.1), _restarted(self.swing, t[0]))
            favour = 0.9 if name == "disc" and self.look.even else 1.0
            if swing is not None and swing.rms_px * favour < least:
                best, least = candidate, swing.rms_px * favour
                self.ordinary_misfit = float(np.percentile(misfit, 90))
                # a rolling shutter shears the outline where the bob is fast: what is ordinary is not hidden
                self.ordinary_visible = float(np.clip(np.median(visible) - 0.1, 0.65, 0.85))
                self.swing = swing
        return best

    # --- geometry -------------------------------------------------------------------------------------------------

    def _camera(self, frame: Frame) -> CameraShift:
        """The camera's shift in this frame. One that seems to stand still is only looked at now and then."""
        known = self._shifts.get(frame.index)
        if known is not None:
            return known if self.shaking else STILL
        check = not self.shaking and frame.index % _CHECK_EVERY == 0
        if len(self.anchors) < 2 or not (self.shaking or check):
            return STILL
        found = self.anchors.shift(frame.luma)
        if self.shaking:
            last = self.record.shift[-1] if self.record.shift else None
            found = found or last or STILL
        if found is not None:
            self._shifts[frame.index] = found
            if check:
                self.checks[len(self.record.index)] = found
                if np.hypot(found.x_px, found.y_px) > max(0.4, 6 * found.sigma_px):
                    self.shaking = True
                    return found
        return found if self.shaking and found is not None else STILL

    def _guess(self, x: float, y: float, bx: float, by: float) -> Guess:
        px, py = self.pivot or self.swing.pivot_px
        return Guess(x, y, bx, by, float(np.arctan2(py - y, px - x)))

    def _patch(self, frame: Frame, look: Look, guess: Guess) -> Patch | None:
        """The patch about the guess, with the background behind it, in the pixels of a still camera."""
        half = (
            1.25 * look.radius_px + 4 * look.edge_px + 4 + 0.5 * float(np.hypot(guess.streak_x_px, guess.streak_y_px))
        )
        dx, dy = self._camera(frame).at(guess.x_px, guess.y_px)
        patch = cut(frame, self.sight, guess.x_px + dx, guess.y_px + dy, half)
        if patch is None:
            return None
        rows, columns = patch.image.shape
        x0, y0 = int(patch.x_px) - round(dx), int(patch.y_px) - round(dy)
        if not self.shaking:
            window = (slice(y0, y0 + rows), slice(x0, x0 + columns))
            return patch._replace(back=self.back.mean[window], seen=self.back.seen[window])
        back, seen = self.back.window(x0, y0, columns, rows, dx - round(dx), dy - round(dy))
        return Patch(patch.image, back, seen, patch.x_px - dx, patch.y_px - dy)

    # --- following ------------------------------------------------------------------------------------------------

    def follow(self, frame: Frame) -> None:
        """Measure one frame, in the order of the file."""
        shift = self._camera(frame)
        x, y, vx, vy = self._expect(frame.t_s)
        if len(self.recent) < 3 and frame.index in self._found:
            x, y = self._found[frame.index]  # the motion fitted to the start may be poor at its rim
        guess = self._guess(x, y, vx * self.exposure_s, vy * self.exposure_s)
        repeated = self._is_repeat(frame)
        patch = None if repeated else self._patch(frame, self.look, guess)
        place = NOWHERE if patch is None else self._locate(patch, guess)
        ok = self._believe(place, x, y)
        if not ok and not repeated:
            place, patch, ok = self._look_around(frame, guess, place, patch)
        ok = ok and patch is not None and self._stands_out(patch, place)
        r = self.record
        r.index.append(frame.index)
        r.t_s.append(frame.t_s)
        r.place.append(place)
        r.ok.append(ok)
        r.shift.append(shift if self.shaking else None)
        r.repeated.append(repeated)
        if ok and patch is not None:
            self._remember(frame, place)
            if self.astray > 0.1 * self.look.radius_px + 1 and len(r.index) - self._fitted_at > 60:
                self._refit()
            self._update_background(patch, place, guess)
            if len(r.index) % _STRING_EVERY == 1:
                self._measure_string(frame, place, shift)
        elif not repeated:
            self.hidden += 1
            if self.hidden == 2:
                self._refit()
        if len(r.index) == len(self.first):
            self._look_back(self.first)
            self.first = []

    def _locate(self, patch: Patch, guess: Guess) -> Place:
        if not self.hidden and len(self.recent) == 3:
            place = self.localiser.locate(patch, self.look, guess)
            if np.isfinite(place.x_px):
                return place
        wide = fit_disc(patch, self.look._replace(noise=np.inf), guess, soften=2.5, turns=12)
        if wide is not None:  # beside a shadow, a wide look may find nothing where a close one does
            guess = guess._replace(x_px=wide[0] + patch.x_px, y_px=wide[1] + patch.y_px)
        return self.localiser.locate(patch, self.look, guess)

    def _look_around(
        self, frame: Frame, guess: Guess, place: Place, patch: Patch | None
    ) -> tuple[Place, Patch | None, bool]:
        """Not where it should be: the bob's outline within some radii of there, the wider the longer it was not seen."""
        look = self.look
        reach = min(6.0, 1.0 + 0.5 * self.hidden) * look.radius_px + 4
        wide = self._patch(frame, look._replace(radius_px=look.radius_px + reach / 1.25), guess)
        if wide is None:
            return place, patch, False
        sign = 1 if look.contrast > 0 else -1
        found = find_round_near(wide.image - wide.back, look.radius_px, sign, look.edge_px)
        if found is None or found[2] < 0.6:
            return place, patch, False
        near = guess._replace(x_px=found[0] + wide.x_px, y_px=found[1] + wide.y_px)
        close = self._patch(frame, look, near)
        if close is None:
            return place, patch, False
        other = self._locate(close, near)
        px, py = self.pivot or self.swing.pivot_px
        off_arc = abs(np.hypot(other.x_px - px, other.y_px - py) - np.hypot(guess.x_px - px, guess.y_px - py))
        alike = other.visible >= 0.9 and 0.6 < other.contrast / look.contrast < 1.6
        if alike and self._believe(other, near.x_px, near.y_px) and off_arc < 0.5 * look.radius_px + 2:
            return other, close, True
        return place, patch, False

    def _believe(self, place: Place, x: float, y: float) -> bool:
        look = self.look
        if not np.isfinite(place.x_px):
            return False
        ratio = place.contrast / look.contrast
        shade = abs(place.contrast + place.wall - self._shade)
        if np.isnan(place.wall):  # a localiser for bobs with a pattern, which show now this side, now that
            bright = 0.25 < ratio < 4.0
        elif np.isnan(shade) or self.hidden > 15:
            bright = 0.5 < ratio < 2.0
        else:  # before something of another shade the contrast is another, but the bob is as bright as ever
            bright = 0.3 < ratio < 2.5 and shade < 0.1 * abs(look.contrast) + 3 * self._shade_scatter
        return bool(
            bright
            and place.visible >= self.ordinary_visible
            and place.misfit < 2 * self.ordinary_misfit + 0.03 * abs(look.contrast)
            and np.hypot(place.x_px - x, place.y_px - y) < 0.6 * look.radius_px + 2
        )

    def _stands_out(self, patch: Patch, place: Place) -> bool:
        """Does the bob differ from what is known to stand still where it is? Half behind a post of about its own brightness it
        seems whole: where nearly half of it could not be told from what is there without it, it is not believed."""
        shade = self._shade
        if np.isnan(shade) or not np.isfinite(place.wall):
            return True
        columns = np.round(place.x_px - patch.x_px + self.look.radius_px * _WITHIN[0]).astype(int)
        rows = np.round(place.y_px - patch.y_px + self.look.radius_px * _WITHIN[1]).astype(int)
        height, width = patch.back.shape
        inside = (columns >= 0) & (rows >= 0) & (columns < width) & (rows < height)
        if inside.sum() < 8:
            return True
        level = patch.back[rows[inside], columns[inside]]
        return bool(np.mean(np.abs(level - shade) > 0.45 * abs(self.look.contrast)) > 0.6)

    def _remember(self, frame: Frame, place: Place) -> None:
        """What the next frames are judged by."""
        self.hidden = 0
        self.recent.append((frame.t_s, place.x_px, place.y_px))
        shade = place.contrast + place.wall
        if np.isnan(self._shade):
            self._shade = shade
        else:
            self._shade_scatter += 0.1 * (abs(shade - self._shade) - self._shade_scatter)
            self._shade += 0.1 * (shade - self._shade)

    def _look_back(self, frames: list[Frame]) -> None:
        """Look again, backwards in time, for the bob on the frames read ahead on which it was not found."""
        r = self.record
        if all(r.ok):
            return
        self._refit()
        kept = self.recent, self.hidden
        self.recent = deque(maxlen=3)
        for k in reversed(range(len(frames))):
            frame = frames[k]
            if r.ok[k]:
                self.recent.append((frame.t_s, r.place[k].x_px, r.place[k].y_px))
                self.hidden = 0
            elif self.recent and not r.repeated[k]:
                x, y, vx, vy = self._expect(frame.t_s)
                guess = self._guess(x, y, vx * self.exposure_s, vy * self.exposure_s)
                patch = self._patch(frame, self.look, guess)
                place = NOWHERE if patch is None else self._locate(patch, guess)
                ok = self._believe(place, x, y)
                if not ok:
                    place, patch, ok = self._look_around(frame, guess, place, patch)
                if ok and patch is not None and self._stands_out(patch, place):
                    r.place[k], r.ok[k] = place, True
                    self._remember(frame, place)
                else:
                    self.hidden += 1
        self.recent, self.hidden = kept

    def _expect(self, t: float) -> tuple[float, float, float, float]:
        """Where the bob should be at time t and how fast, px and px/s: the fitted motion, moved by how far the bob was
        from it in the last frames."""
        recent = list(self.recent)[-2:]
        if recent and abs(t - self.swing.t0_s) > 1.0:  # start anew from near by, so that no long way is integrated
            self.swing = replace(self.swing, values=_restarted(self.swing, recent[-1][0]), t0_s=recent[-1][0])
        v = self.swing.values.tolist()
        theta, rate = (a.tolist() for a in self.swing.angle(np.array([*(r[0] for r in recent), t])))
        if not isfinite(sum(theta) + rate[-1]):  # a motion fitted to too little may run away
            x, y = recent[-1][1:] if recent else v[:2]
            return x, y, 0.0, 0.0
        xs, ys = [v[0] + v[2] * sin(a + v[3]) for a in theta], [v[1] + v[2] * cos(a + v[3]) for a in theta]
        x, y = xs[-1], ys[-1]
        vx, vy = v[2] * rate[-1] * cos(theta[-1] + v[3]), -v[2] * rate[-1] * sin(theta[-1] + v[3])
        if not recent:
            return x, y, vx, vy
        offs = [(r[1] - a, r[2] - b) for r, a, b in zip(recent, xs, ys)]
        (ox, oy), far = offs[-1], t - recent[-1][0]
        if len(recent) == 2 and not self.hidden and recent[1][0] != recent[0][0]:
            lead = min(1.0, far / (recent[1][0] - recent[0][0]))
            ox, oy = ox + lead * (ox - offs[0][0]), oy + lead * (oy - offs[0][1])
        self.astray = hypot(ox, oy)
        return x + ox, y + oy, vx, vy

    def _refit(self) -> None:
        """Fit the motion to what was measured last, to see through a gap."""
        r = self.record
        self._fitted_at = len(r.index)
        good = [k for k in range(max(0, len(r.ok) - 600), len(r.ok)) if r.ok[k]]
        if len(good) < 20:
            return
        t, x, y = np.array([(r.t_s[k], r.place[k].x_px, r.place[k].y_px) for k in good]).T
        calm = {"gamma": (0.0, 0.1), "beta": (0.0, 0.5)}  # little was seen yet: no wild guesses
        swing = fit_swing(t, x, y, np.full(t.size, 0.5), _restarted(self.swing, t[0]), prior=calm)
        if swing is not None and swing.rms_px < 0.25 * self.look.radius_px + 1:
            self.swing = swing

    def _update_background(self, patch: Patch, place: Place, guess: Guess) -> None:
        rows, columns = patch.image.shape
        dx, dy = patch.x_px - round(patch.x_px), patch.y_px - round(patch.y_px)
        if abs(dx) > 0.2 or abs(dy) > 0.2:
            return  # a shaken frame that lies between the background's pixels would blur it
        x0, y0 = round(patch.x_px), round(patch.y_px)
        if x0 < 0 or y0 < 0 or x0 + columns > self.shape[1] or y0 + rows > self.shape[0]:
            return
        streak = 0.5 * float(np.hypot(guess.streak_x_px, guess.streak_y_px))
        keep_out = 1.05 * self.look.radius_px + 3 * self.look.edge_px + 1 + streak
        box = (x0, y0, x0 + columns, y0 + rows)
        self.back.add(patch.image, box, (place.x_px, place.y_px, keep_out), self.pivot or self.swing.pivot_px)

    def _measure_string(self, frame: Frame, place: Place, shift: CameraShift) -> None:
        px, py = self.pivot or self.swing.pivot_px
        dx, dy = shift.at(place.x_px, place.y_px)
        qx, qy = shift.at(px, py)
        bob = (place.x_px + dx, place.y_px + dy)
        line = measure_string(frame.luma, bob, (px + qx, py + qy), self.look.radius_px)
        if line is not None:
            sx, sy = shift.at(line.x_px, line.y_px)
            self.record.string[len(self.record.index) - 1] = (
                line.x_px - sx,
                line.y_px - sy,
                line.angle_rad + shift.roll_rad,
                line.sigma_angle_rad,
                line.sigma_px,
            )

    def _is_repeat(self, frame: Frame) -> bool:
        """Is it the picture before, shown again?"""
        coarse = frame.luma[4::16, 4::16].astype(np.int16)
        before, self._print = self._print, coarse
        return before is not None and bool(np.abs(coarse - before).max() <= 1)


def _restarted(swing: Swing, t0: float) -> np.ndarray:
    """The motion's values with its state at time t0."""
    theta, rate = swing.angle(np.array([t0]))
    values = swing.values.copy()
    values[7:] = theta[0], rate[0]
    return values
