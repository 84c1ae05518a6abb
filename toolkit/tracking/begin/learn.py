"""What the frames read ahead teach: how the camera moves, what stands behind the bob, how the bob looks, what suits it."""

from __future__ import annotations

from math import atan2, hypot

import numpy as np

from toolkit.trackers import load_tracker, tracker_names
from toolkit.trackers.disc import fit_disc
from toolkit.trackers.localiser import NOWHERE, Guess, Localiser, Look, Patch, Place
from toolkit.tracking.begin.acquire import is_even, scattered
from toolkit.tracking.begin.bold import STEADY, learn_bold, on_swing
from toolkit.tracking.begin.trail import Rough, cut
from toolkit.tracking.begin.trial import SHOWS, Trial, judge, take_best, told_choice
from toolkit.tracking.geometry.swing import CALM, fit_swing
from toolkit.tracking.picture.background import Background
from toolkit.tracking.picture.front import EVEN, Rhythm, find_front, fit_each, is_clear, typical
from toolkit.tracking.picture.looks import Looks, Sightings, grown, learn_looks
from toolkit.tracking.picture.plane import still_picture
from toolkit.tracking.picture.shadow import Shaded, Shadow, find_shadow, find_shadow_near
from toolkit.tracking.picture.sight import LUMA, Sight, maybe_shadow
from toolkit.tracking.picture.stillness import STILL, Anchors, CameraShift
from toolkit.video import Frame

_CHECK_EVERY = 12
_SAMPLES = 20  # frames on which it is looked whether anything hides the bob
_ENOUGH = 12  # frames
_WAVERS = 0.02  # of the radius: what strays more from a swing may have a pattern up to its outline
_LEAPS_PX = 0.3  # so far a camera that a hand holds makes any bob stray
_ROUND = 0.75  # of the outline: of a bold pattern's less is to be seen now and then
_HARDLY = 0.1  # of the outline, at least, is seen of a bob with a bold pattern
_CASTS = 2.5, 1.0, 1.0  # the bob's edge is so much softer as it is found with a shadow cast anew each time
_LESS = 0.8  # of the misfit: by so much a bob with a pattern is explained better with a shadow


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
        self.rival_px = rough.rival_px
        self.interval_s = float(np.median(np.diff([f.t_s for f in batch]))) or 1 / 30
        points = self._learn_stillness(batch, rough)
        self.shadow: Shadow | None = None
        self.front: np.ndarray | None = None
        self._learn_background(batch, rough.look, points)
        before = self.swing, points
        looks, points = self._learn_bob(batch, *self._learn_front(batch, rough.look, points), radius)
        if self.front is not None and not (looks.look.even and looks.look.noise < EVEN * abs(looks.look.contrast)):
            self.front = self.shadow = None  # what looked like the wall is a part of the bob's pattern
            self.swing, points = before
            self._learn_background(batch, rough.look, points)
            looks, points = self._learn_bob(batch, rough.look, points, radius)
        self.look, self.exposure_s, self.growth = looks
        self.found = {batch[i].index: p for i, p in points.items()}
        self.ordinary_misfit = self.look.noise
        self.ordinary_visible: tuple[tuple[float, float], tuple[float, float]] = ((0.0, 1.0), (0.85, 0.85))
        self.ordinary_shade = np.nan, np.nan
        self.choice = ""  # how the localiser was chosen, where there was a choice
        self.bold = False  # is some of the bob's pattern like the wall, up to the outline?
        self.localiser: Localiser = self._choose(
            batch, points, wanted, rough.look._replace(radius_px=radius or rough.look.radius_px), radius
        )

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
        some = [batch[i].luma for i in range(0, len(batch), max(1, len(batch) // 12))]
        probe = [self.anchors.shift(luma) for luma in some]
        if self.anchors.forget_passing():
            probe = [self.anchors.shift(luma) for luma in some]
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
        better = fit_swing(t, x, y, np.full(t.size, 0.3), rough.swing.values_at(t[0]))
        self.swing = better or self.swing
        return points

    def _learn_background(self, batch: list[Frame], look: Look, points: dict[int, tuple[float, float]]) -> None:
        self.back = Background((self.shape[0], self.shape[1]))
        xs, ys = np.array(list(points.values())).T
        grow = 3 * look.radius_px + 20
        x0, y0 = max(0, int(xs.min() - grow)), max(0, int(ys.min() - grow))
        x1, y1 = min(self.shape[1], int(xs.max() + grow)), min(self.shape[0], int(ys.max() + grow))
        every = max(1, round(len(batch) / 40))
        pivot = self.pivot or self.swing.pivot_px
        some = {i: place for i, place in points.items() if i % every == 0}
        shifts = [(round(dx), round(dy)) for dx, dy in (self._camera(batch[i]).at(*some[i]) for i in some)]
        bobs = [self._dark(x, y, 1.1 * look.radius_px + 2 * look.edge_px + 2) for x, y in some.values()]
        plain = self.sight.weights == LUMA
        if plain and some and batch[0].luma.strides[1] == 1:  # it was not turned
            self.back.add_all([batch[i].luma for i in some], shifts, (x0, y0, x1, y1), bobs, pivot)
        else:
            for i, (dx, dy), bob in zip(some, shifts, bobs):
                a, b = max(x0, -dx), max(y0, -dy)
                c, d = min(x1, self.shape[1] - dx), min(y1, self.shape[0] - dy)
                if c - a >= 4 and d - b >= 4:
                    piece = self.sight.window(batch[i], a + dx, b + dy, c + dx, d + dy)
                    self.back.add(piece, (a, b, c, d), bob, pivot)
        self.back.fill_gaps((x0, y0, x1, y1))
        few = [batch[i] for i in scattered(len(batch), 5)]
        still = still_picture([f.luma if plain else self.sight.window(f, 0, 0, *self.shape[::-1]) for f in few])
        beyond = (np.s_[:y0], np.s_[y1:], np.s_[y0:y1, :x0], np.s_[y0:y1, x1:])
        for part in beyond:  # where the bob was not found (yet) the picture is what stands still
            self.back.mean[part], self.back.seen[part] = still[part], 1.0
        if self.front is not None:
            self.back.stand_before(self.front)

    def _learn_front(
        self, batch: list[Frame], look: Look, points: dict[int, tuple[float, float]]
    ) -> tuple[Look, dict[int, tuple[float, float]]]:
        """Does something stand before the bob's way? Then its looks and points are those where enough of it shows; `front` says
        where that something is. Else they are as before."""
        before = look, points
        t_s = np.array([frame.t_s for frame in batch])
        places = points

        def show(i: int, x: float, y: float) -> tuple[Guess, Patch | None]:
            guess = self._guess(x, y, 0.0, 0.0, 0.0)
            return guess, self._patch(batch[i], look, guess)

        some = dict(list(points.items())[:: max(1, len(points) // _SAMPLES)])
        if len(points) > 0.97 * len(batch):
            for far in (False, True):
                if sum(map(is_clear, fit_each(show, some, look, far).values())) == len(some):
                    return before
        for _ in range(2):  # what stands before it spoils the points by which it is found
            fits = fit_each(show, places, look)
            rhythm = Rhythm.through(t_s, fits, self.swing.period_s) if len(fits) >= _ENOUGH else None
            if rhythm is None or rhythm.strays_px > 0.1 * look.radius_px:
                self.front = None
                break
            fits = {i: fit for (i, fit), true in zip(fits.items(), rhythm.true) if true}
            points = {i: (float(fit[0]), float(fit[1])) for i, fit in fits.items()}
            places = dict(enumerate(map(tuple, rhythm.position(t_s).tolist()))) | points
            look, shade = typical(look, list(fits.values()))
            self.front = None
            self._learn_background(batch, look, places)
            self.front = find_front(show, places, self.back, look, shade)
            if self.front is None:
                break
            self.back.stand_before(self.front)
        if self.front is not None:
            t, (x, y) = t_s[list(points)], np.array(list(points.values())).T
            self.swing = fit_swing(t, x, y, np.full(t.size, 0.3), self.swing.values_at(t[0]), prior=CALM) or self.swing
            return look, points
        self._learn_background(batch, *before)
        return before

    def _dark(self, x: float, y: float, reach: float) -> tuple[float, float, float]:
        """The circle (x, y, radius) in which the bob, or its shadow, changes the background."""
        return (x, y, reach) if self.shadow is None else self.shadow.circle(x, y, reach)

    def _learn_bob(
        self, batch: list[Frame], look: Look, points: dict[int, tuple[float, float]], radius: float | None
    ) -> tuple[Looks, dict[int, tuple[float, float]]]:
        """The looks, and its shadow; the points without what the shadow drew them by."""
        alone = self._learn_looks(batch, look, points, radius)
        shaded = self._learn_shadow(batch, alone.look, points)
        if shaded is None or not (shaded.taken_for_bob or self.sight.weights == LUMA):
            return alone, points
        before, sight, self.sight = self.back, self.sight, Sight(LUMA)
        bare, without = self._without_shadow(batch, shaded, points, radius)
        clearer = self._learn_shadow(batch, bare, without, shaded)
        if clearer is not None:
            bare, without = self._without_shadow(batch, clearer, without, radius)
        bare = bare._replace(noise=alone.look.noise)
        looks = self._learn_looks(batch, bare, without, radius)
        less = 1.0 if alone.look.even or looks.look.even else _LESS
        if shaded.taken_for_bob or looks.look.noise < less * alone.look.noise:
            return looks, without
        self.sight, self.shadow = sight, None  # a bob with a pattern, or drawn out by the lens, but no shadow
        self.back = before
        return alone, points

    def _without_shadow(
        self, batch: list[Frame], shaded: Shaded, points: dict[int, tuple[float, float]], radius: float | None
    ) -> tuple[Look, dict[int, tuple[float, float]]]:
        """The looks of the bob alone, and where it is: the shadow drew each point another way, as the string hid another part of
        both."""
        self.shadow = shaded.shadow
        points = {i: (x + shaded.x_px, y + shaded.y_px) for i, (x, y) in points.items()}
        look = Look(radius or shaded.radius_px, shaded.edge_px, shaded.contrast, np.inf)
        self._learn_background(batch, look, points)
        for i, found in points.items():
            place = found
            for soften in _CASTS:
                guess = self._guess(*place, 0.0, 0.0, 0.0)
                patch = self._patch(batch[i], look, guess)
                fit = None if patch is None else fit_disc(patch, look, guess, soften=soften, turns=12)
                if patch is None or fit is None:
                    break
                place = float(fit[0] + patch.x_px), float(fit[1] + patch.y_px)
            else:
                if hypot(place[0] - found[0], place[1] - found[1]) < look.radius_px:
                    points[i] = place
        return look, points

    def _learn_shadow(
        self, batch: list[Frame], look: Look, points: dict[int, tuple[float, float]], about: Shaded | None = None
    ) -> Shaded | None:
        """The shadow beside a bob of about this look, from the frames on which it is slow; more closely where it is known `about`."""
        numbers = np.array(list(points))
        speed = np.hypot(*self.swing.velocity(np.array([batch[i].t_s for i in numbers])))
        slow = numbers[np.argsort(speed)[: max(10, numbers.size // 3)]]
        slow = slow[:: max(1, slow.size // 10)]
        before, sight, shadow = self.back, self.sight, self.shadow
        self.sight, self.shadow = Sight(LUMA), None  # in a colour difference a shadow hardly shows
        if sight != self.sight:
            if not maybe_shadow([batch[i] for i in slow], [points[i] for i in slow], look.radius_px):
                self.sight, self.shadow = sight, shadow
                return None
            look = look._replace(contrast=0.0, noise=np.inf)
            self._learn_background(batch, look, points)
        half = (2.5 * look.radius_px + 12,) * 2
        seen = []
        for i in slow:
            guess = self._guess(*points[i], 0.0, 0.0, 0.0)
            patch = self._patch(batch[i], look, guess, half)
            if patch is not None:
                seen.append((patch, guess))
        self.back, self.sight, self.shadow = before, sight, shadow
        return find_shadow(seen, look) if about is None else find_shadow_near(seen, look, about)

    def _sightings(self, batch: list[Frame], points: dict[int, tuple[float, float]]) -> Sightings:
        numbers = list(points)
        velocity = self.swing.velocity(np.array([batch[i].t_s for i in numbers]))

        def show(k: int, look: Look, centre: tuple[float, float], streak_s: float) -> tuple[Guess, Patch | None]:
            vx, vy = (float(v[k]) for v in velocity)
            guess = self._guess(*centre, vx, vy, streak_s)
            return guess, self._patch(batch[numbers[k]], look, guess)

        x, y = np.array(list(points.values())).T
        return Sightings(x, y, *velocity, show)

    def _learn_looks(
        self, batch: list[Frame], look: Look, points: dict[int, tuple[float, float]], radius: float | None
    ) -> Looks:
        """The looks of the bob at these points; those of `look`, but by its outline alone, where no disc can be fitted."""
        seen = self._sightings(batch, points)
        # what else there is beside the bob (a shadow) is fitted too, unless it must stand out as none of it
        strict = look._replace(noise=0.05 * abs(look.contrast) + 1.0)
        found = learn_looks(seen, look, radius, self.interval_s, self.shape)
        if found is None or not is_even(found.look):
            other = learn_looks(seen, strict, radius, self.interval_s, self.shape)
            if other is not None and (found is None or other.look.noise < 0.6 * found.look.noise):
                found = other
        return found or Looks(look._replace(even=False))

    def _choose(
        self,
        batch: list[Frame],
        points: dict[int, tuple[float, float]],
        wanted: str | None,
        rough: Look,
        radius: float | None,
    ) -> Localiser:
        """The localiser asked for; else the disc fit where its model holds; else the one whose model leaves least of the picture
        unexplained (χ²), of the outline fit and the disc fit or, for a bob of one shade, of all there are: `choice` says of which.
        Also learns what is ordinary for it."""
        looks = Looks(self.look, self.exposure_s, self.growth)
        first = self._try(load_tracker(wanted or "disc"), looks, batch, points)
        tried = [first]
        poor = self.look.noise > 0.05 * abs(self.look.contrast) + 2.5
        doubted = not wanted and (poor or not self.look.even)
        if doubted:
            edge = load_tracker("edge")
            drawn = not (looks.look.even and first and first.swing.rms_px < _WAVERS * looks.look.radius_px)
            own = self._try_outline(edge, batch, points, rough, radius, looks) if drawn else None
            given = self._try(edge, looks, batch, points)
            calmer = own is not None and (given is None or own.calmer_than(given))
            tried.append(own if calmer else given)
            least_px = min((trial.swing.rms_px for trial in tried if trial is not None), default=np.inf)
            if looks.look.even or not any(tried):
                others = (name for name in tracker_names() if name not in ("disc", "edge"))
                tried += [self._try(load_tracker(name), looks, batch, points) for name in others]
            elif least_px > max(_WAVERS * looks.look.radius_px, _LEAPS_PX):
                tried += self._try_middles(looks, batch, points)
        self.look, self.exposure_s, self.growth = looks
        found = [trial for trial in tried if trial is not None]
        if not found:
            return load_tracker(wanted or "disc")
        if doubted:
            self.choice = told_choice(found, abs(self.look.contrast))
        best = take_best(found, self.look)
        self.look, self.exposure_s, self.growth = best.looks
        self.swing, self.ordinary_misfit, self.ordinary_visible = best.swing, best.misfit, best.visible
        self.ordinary_shade = best.shade
        if best.looks != looks:
            self.bold = min(best.visible[1]) < _ROUND
            if self.bold:
                self.ordinary_visible = (0.0, 1.0), (_HARDLY, _HARDLY)
            if self.bold and best.swing.rms_px < STEADY * self.look.radius_px:
                t_s = np.array([batch[i].t_s for i in points])
                points = on_swing(points, t_s, self.swing)
                self.found |= {batch[i].index: p for i, p in points.items()}
            self._learn_background(batch, self.look, points)
        return best.localiser

    def _try_outline(
        self,
        edge: Localiser,
        batch: list[Frame],
        points: dict[int, tuple[float, float]],
        rough: Look,
        radius: float | None,
        looks: Looks,
    ) -> Trial | None:
        """The outline fit with the looks that the outlines themselves have, but that the bob grows as the disc fit has learned; None
        where they tell none."""
        t_s = np.array([batch[i].t_s for i in points])
        seen = self._sightings(batch, points)
        learned = learn_bold(seen, t_s, rough, self.swing, radius, self.interval_s)
        if learned is None:
            return None
        if learned.calm:
            points = on_swing(points, t_s, learned.swing)
        look, slope = learned.looks.look, None if looks.growth is None else looks.growth[0]
        growth = None if slope is None else (slope, look.radius_px - slope * float(np.median(seen.x_px)))
        outlined = Looks(look._replace(radius_free=looks.look.radius_free), learned.looks.exposure_s, growth)
        return self._try(edge, outlined, batch, points, _HARDLY)

    def _try_middles(self, looks: Looks, batch: list[Frame], points: dict[int, tuple[float, float]]) -> list[Trial]:
        """The localisers that take the middle of what is like the bob, where this is steady: parts of a pattern pull it, but circles
        that leap about lie on no round bob."""
        middles = (localiser for localiser in map(load_tracker, tracker_names()) if not localiser.circle)
        trials = (self._try(localiser, looks, batch, points, None) for localiser in middles)
        return [t for t in trials if t is not None and t.swing.rms_px < STEADY * looks.look.radius_px]

    def _try(
        self,
        localiser: Localiser,
        looks: Looks,
        batch: list[Frame],
        points: dict[int, tuple[float, float]],
        shows: float | None = SHOWS,
    ) -> Trial | None:
        """What this localiser makes of the frames on which the bob was found, if it looks so; None where it sees it, or this share of
        its outline, on too few. Without a share what counts is how much it usually sees: it takes the bob for no circle."""
        self.look, self.exposure_s, self.growth = looks
        velocity = self.swing.velocity(np.array([batch[i].t_s for i in points]))
        places = {}
        for i, vx, vy in zip(points, *velocity):
            guess = self._guess(*points[i], float(vx), float(vy), self.exposure_s)
            patch = self._patch(batch[i], self.look, guess)
            place = NOWHERE if patch is None else localiser.locate(patch, self.look_at(guess), guess)
            place, _ = self._beside_shadow(localiser, batch[i], guess, place) or (place, patch)
            if np.isfinite(place.x_px):
                places[i] = place
        t_s = np.array([frame.t_s for frame in batch])
        return judge(localiser, looks, places, t_s, self.swing, len(points), shows)

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

    def _guess(self, x: float, y: float, vx: float, vy: float, exposure_s: float) -> Guess:
        """Of a bob there, at this velocity (px/s), that the shutter shows for so long."""
        px, py = self.pivot or self.swing.pivot_px
        string = atan2(py - y, px - x)
        if not exposure_s:
            return Guess(x, y, 0.0, 0.0, string)
        ax, ay = self.swing.acceleration_at(x, y, vx, vy)
        half = 0.5 * exposure_s * exposure_s
        return Guess(x, y, vx * exposure_s, vy * exposure_s, string, bend_x_px=half * ax, bend_y_px=half * ay)

    def look_at(self, guess: Guess) -> Look:
        """The bob's looks at a place: nearer to the camera it is larger."""
        return grown(self.look, self.growth, guess.x_px)

    def _beside_shadow(
        self, localiser: Localiser, frame: Frame, guess: Guess, place: Place
    ) -> tuple[Place, Patch] | None:
        """Where the bob has a shadow: the place found once more, with the shadow of a bob there; and the patch."""
        if self.shadow is None or not np.isfinite(place.x_px):
            return None
        near = guess._replace(x_px=place.x_px, y_px=place.y_px)
        patch = self._patch(frame, self.look, near)
        again = NOWHERE if patch is None else localiser.locate(patch, self.look_at(near), near)
        return None if patch is None or not np.isfinite(again.x_px) else (again, patch)

    def _patch(self, frame: Frame, look: Look, guess: Guess, half: tuple[float, float] | None = None) -> Patch | None:
        """The patch about the guess, with the background behind it, in the pixels of a still camera; as large as the bob
        and its streak need, or ±half."""
        if half is None:
            streak = 0.5 * hypot(guess.streak_x_px, guess.streak_y_px)
            half = (1.25 * look.radius_px + 4 * look.edge_px + 4 + streak,) * 2
        dx, dy = self._camera(frame).at(guess.x_px, guess.y_px)
        patch = cut(frame, self.sight, guess.x_px + dx, guess.y_px + dy, *half)
        if patch is None:
            return None
        rows, columns = patch.image.shape
        x0, y0 = int(patch.x_px) - round(dx), int(patch.y_px) - round(dy)
        if not self.shaking:
            window = (slice(y0, y0 + rows), slice(x0, x0 + columns))
            patch = patch._replace(back=self.back.mean[window], seen=self.back.seen[window])
        else:
            back, seen = self.back.window(x0, y0, columns, rows, dx - round(dx), dy - round(dy))
            patch = Patch(patch.image, back, seen, patch.x_px - dx, patch.y_px - dy)
        return patch if self.shadow is None else self.shadow.cast(patch, guess)
