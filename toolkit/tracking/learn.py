"""What the frames read ahead teach: how the camera moves, what stands behind the bob, how the bob looks, what suits it."""

from __future__ import annotations

import numpy as np

from toolkit.trackers import load_tracker
from toolkit.trackers.disc import fit_disc
from toolkit.trackers.localiser import NOWHERE, Guess, Localiser, Look, Patch
from toolkit.tracking.acquire import Rough, cut, is_even, scattered
from toolkit.tracking.background import Background
from toolkit.tracking.search import still_picture
from toolkit.tracking.sight import LUMA
from toolkit.tracking.stillness import STILL, Anchors, CameraShift
from toolkit.tracking.swing import Swing, fit_swing
from toolkit.video import Frame

_CHECK_EVERY = 12


class Known:
    """All that is known of one bob and of the picture behind it, from what was found in the frames read ahead.

    After construction `look`, `exposure_s`, `shaking` and `localiser` say what was learned.
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
        self.interval_s = float(np.median(np.diff([f.t_s for f in batch]))) or 1 / 30
        points = self._learn_stillness(batch, rough)
        self.found = {batch[i].index: p for i, p in points.items()}
        self._learn_background(batch, rough.look, points)
        self.growth: tuple[float, ...] | None = None  # slope and intercept of the bob's radius along x
        self.look, self.exposure_s = self._learn_looks(batch, rough.look, points, radius)
        if not is_even(self.look):
            # what else there is beside the bob (a shadow) was fitted too, unless it must stand out as none of it
            strict = rough.look._replace(noise=0.05 * abs(rough.look.contrast) + 1.0)
            look, exposure_s = self._learn_looks(batch, strict, points, radius)
            if look.noise < 0.6 * self.look.noise:
                self.look, self.exposure_s = look, exposure_s
        self.ordinary_misfit = self.look.noise
        self.ordinary_visible = 0.85
        self.localiser: Localiser = self._choose(batch, points, wanted)

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
        self.checks: dict[int, CameraShift] = {}  # by the frame's index, while the camera seems to stand still
        self._last_shift: CameraShift | None = None
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
        better = fit_swing(t, x, y, np.full(t.size, 0.3), restarted(rough.swing, t[0]))
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
        beyond = np.ones(self.shape, bool)  # where the bob was not found (yet) the picture is what stands still
        beyond[y0:y1, x0:x1] = False
        few = [batch[i] for i in scattered(len(batch), 5)]
        plain = self.sight.weights == LUMA
        still = still_picture([f.luma if plain else self.sight.window(f, 0, 0, *self.shape[::-1]) for f in few])
        np.copyto(self.back.mean, still, where=beyond)
        self.back.seen[beyond] = 1.0

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
            quiet.append(1.4826 * float(np.median(np.abs(patch.image - light_on(patch) * patch.back))))
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
                    where = np.array([points[numbers[k]][0] for k, f in zip(slow, found) if f is not None])
                    self.growth = tuple(np.polyfit(where, sizes, 1)) if change > max(0.05, 4 * spread) else None
                    look = look._replace(radius_free=bool(change > max(0.05, 4 * spread)))
            if (
                not look.even and look.noise > drawn
            ):  # a pattern up to the outline: size and streak cannot be told by it
                return look._replace(radius_free=False), 0.0
            if speed.max() * self.interval_s < 1.0:
                break
            fast = np.argsort(-speed)[:10]
            trials = np.linspace(0, 1, 11)
            each = np.full((trials.size, fast.size), np.inf)
            for j, part in enumerate(trials):
                for n, k in enumerate(fast):
                    trial = fit(k, look, part * self.interval_s, turns=6)
                    if trial is not None:
                        each[j, n] = trial[7] ** 2
            clear = np.argsort(each.min(axis=0))[:6]  # not those on which something hides a part of it
            cost = each[:, clear].sum(axis=1)
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
            swing = fit_swing(t, x, y, np.full(t.size, 0.1), restarted(self.swing, t[0]))
            # a pattern draws the disc fit along with its turning, slowly: a swing fitted to so few frames hides some of that
            favour = 1.0 if name != "disc" else 0.9 if self.look.even else 1.3
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
            found = found or self._last_shift or STILL
            self._last_shift = found
        if found is not None:
            self._shifts[frame.index] = found
            if check:
                self.checks[frame.index] = found
                if np.hypot(found.x_px, found.y_px) > max(0.4, 6 * found.sigma_px):
                    self.shaking = True
                    return found
        return found if self.shaking and found is not None else STILL

    def _guess(self, x: float, y: float, bx: float, by: float) -> Guess:
        px, py = self.pivot or self.swing.pivot_px
        return Guess(x, y, bx, by, float(np.arctan2(py - y, px - x)))

    def look_at(self, guess: Guess) -> Look:
        """The bob's looks at a place: nearer to the camera it is larger."""
        if self.growth is None or not self.look.radius_free:
            return self.look
        size = self.growth[0] * guess.x_px + self.growth[1]
        return self.look._replace(radius_px=float(np.clip(size, 0.75 * self.look.radius_px, 1.3 * self.look.radius_px)))

    def _patch(self, frame: Frame, look: Look, guess: Guess, half: tuple[float, float] | None = None) -> Patch | None:
        """The patch about the guess, with the background behind it, in the pixels of a still camera; as large as the bob
        and its streak need, or ±half."""
        if half is None:
            streak = 0.5 * float(np.hypot(guess.streak_x_px, guess.streak_y_px))
            half = (1.25 * look.radius_px + 4 * look.edge_px + 4 + streak,) * 2
        dx, dy = self._camera(frame).at(guess.x_px, guess.y_px)
        patch = cut(frame, self.sight, guess.x_px + dx, guess.y_px + dy, *half)
        if patch is None:
            return None
        rows, columns = patch.image.shape
        x0, y0 = int(patch.x_px) - round(dx), int(patch.y_px) - round(dy)
        if not self.shaking:
            window = (slice(y0, y0 + rows), slice(x0, x0 + columns))
            return patch._replace(back=self.back.mean[window], seen=self.back.seen[window])
        back, seen = self.back.window(x0, y0, columns, rows, dx - round(dx), dy - round(dy))
        return Patch(patch.image, back, seen, patch.x_px - dx, patch.y_px - dy)


def restarted(swing: Swing, t0: float) -> np.ndarray:
    """The motion's values with its state at time t0."""
    theta, rate = swing.angle(np.array([t0]))
    values = swing.values.copy()
    values[7:] = theta[0], rate[0]
    return values


def light_on(patch: Patch) -> float:
    """How bright the light is against that of the background."""
    known = patch.seen > 0
    if np.count_nonzero(known) < 20:
        return 1.0
    return float(np.clip(np.median(patch.image[known] / np.maximum(patch.back[known], 1.0)), 0.3, 3.0))
