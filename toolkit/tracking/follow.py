"""The bob followed frame by frame: where it should be, where it is, whether to believe that."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field, replace
from math import cos, hypot, isfinite, isnan, nan, sin

import numpy as np

from toolkit.trackers.disc import fit_disc
from toolkit.trackers.localiser import NOWHERE, Guess, Patch, Place
from toolkit.tracking.begin.learn import Known
from toolkit.tracking.begin.search import find_round_near
from toolkit.tracking.begin.trail import Rough
from toolkit.tracking.geometry.swing import CALM, fit_swing, start_swing
from toolkit.tracking.picture.front import WITHIN, enough_shows, hidden_share
from toolkit.tracking.picture.looks import light_on
from toolkit.tracking.picture.passer import surroundings
from toolkit.tracking.picture.plane import rim_level, silhouette
from toolkit.tracking.picture.repeat import alike, thinned
from toolkit.tracking.picture.spots import tell_bob
from toolkit.tracking.picture.stillness import CameraShift
from toolkit.tracking.picture.string_line import StringLine, measure_string
from toolkit.video import Frame

# frames: so often the string, and its pull on the bob's place, are measured, and for so long; then ever less often
_STRING_EVERY, _STRING_DENSE = 3, 180
_SEARCH_EVERY = 4  # hidden frames
_STEADY = 24  # frames over which a bold pattern draws the bob to one side about as often as to the other
_TELLS = 0.65  # of the bob, or of what is beside it: less than this told from what is behind it shows no bob
_ODD = 1.3  # times the ordinary misfit: with more, something may pass behind the bob
_BETTER = 0.75  # times that misfit: where less is left, it did
_DIM = 0.1  # of the light: by so much another light than lately on the wall is none, but something that passes
# of a bob with a pattern, and of its outline: where so much of this is seen, less than that shows no bob
_FACE, _AROUND = 0.4, 0.85
_FACES = 0.5  # of what is about the bob: so much must be told from it, that its outline says where it is
_UNSTEADY_PX = 0.3  # so far places stray from a swing before a camera that a hand holds


@dataclass
class Record:
    """What was measured, one entry a frame; positions in the first frame's pixels (those of a still camera)."""

    index: list[int] = field(default_factory=list)
    t_s: list[float] = field(default_factory=list)
    place: list[Place] = field(default_factory=list)
    ok: list[bool] = field(default_factory=list)
    repeated: list[bool] = field(default_factory=list)
    kind: list[int] = field(default_factory=list)  # of picture, as the codec coded it
    shift: list[CameraShift | None] = field(default_factory=list)
    string: dict[int, tuple[float, ...]] = field(default_factory=dict)
    pull: dict[int, tuple[float, float]] = field(default_factory=dict)  # by the string on the bob's place, px

    def precede(self, other: Record, count: int) -> None:
        """Put as many of the other's first frames before these; the bob is seen on none of them."""
        self.index[:0], self.t_s[:0], self.kind[:0] = other.index[:count], other.t_s[:count], other.kind[:count]
        self.place[:0], self.shift[:0] = [NOWHERE] * count, [None] * count
        self.ok[:0], self.repeated[:0] = [False] * count, [False] * count
        self.string = {k + count: line for k, line in self.string.items()}
        self.pull = {k + count: pull for k, pull in self.pull.items()}


class Follower(Known):
    """Follows one bob, given what was found in the frames read ahead: call `follow` with every frame in order and read
    `record`."""

    def __init__(
        self,
        batch: list[Frame],
        rough: Rough,
        pivot: tuple[float, float] | None,
        radius: float | None,
        wanted: str | None,
    ) -> None:
        super().__init__(batch, rough, pivot, radius, wanted)
        self.record = Record()
        self.late = 0  # frames of the record before those that were followed
        self.hidden = 0
        self._outlined = 0.0  # how much of the outline was seen itself, of a bob with a pattern
        self.astray = 0.0  # how far the bob was from the fitted motion lately, px
        self._fitted_at = 0
        self._shade_seen = np.nan  # the bob's own brightness at the place judged last
        # the bob's own brightness lately, and how much it changes
        self._shade, scatter = self.ordinary_shade
        self._shade_scatter = max(0.03 * abs(rough.look.contrast), np.nan_to_num(scatter))
        self.first: list[Frame] = []  # the frames read ahead, if they are the first that will be followed
        self.recent: deque[tuple[float, float, float]] = deque(maxlen=_STEADY if self.bold else 3)
        self._picture: Frame | None = None  # the one that is measured
        # how much of a bob with a pattern differs from what stands still: at the place judged last, and lately
        self._unlike_seen = self._usually_unlike = np.full(2, nan)
        self._speed = 0.0  # of the bob on it, px/s
        self._light = nan  # on the wall behind the bob lately, against that when the background was learned
        self._lit: tuple[float, Frame | None] = (nan, None)  # the bob's brightness lately, and on which picture
        self._string: StringLine | None = None  # as it was measured last
        # no background shows how the camera moves, and the bob strays: then the string is measured on every frame
        self.unsteady = len(self.anchors) < 2 and self.swing.rms_px > _UNSTEADY_PX

    def follow(self, frame: Frame) -> None:
        """Measure one frame, in the order of the file."""
        shift = self._camera(frame)
        # the motion fitted to the start may be poor at its rim
        found = self.found.get(frame.index) if self.hidden or len(self.recent) < 3 else None
        guess = self._ahead(frame, found)
        before, self._picture = self._picture, frame
        place, patch = self._measure(frame, guess)
        repeated = before is not None and not (patch is not None and self._moved(place)) and alike(before, frame)
        if repeated:
            place, patch = NOWHERE, None
        r = self.record
        r.index.append(frame.index)
        r.t_s.append(frame.t_s)
        r.place.append(place)
        r.ok.append(patch is not None)
        r.shift.append(shift if self.shaking else None)
        r.repeated.append(repeated)
        r.kind.append(frame.kind)
        if patch is not None:
            self._remember(frame.t_s, place)
            if self.astray > 0.1 * self.look.radius_px + 1 and len(r.index) - self._fitted_at > 60:
                self._refit()
            self._update_background(patch, place, guess)
            count = len(r.index)
            every = _STRING_EVERY * (1 + count // _STRING_DENSE)
            if count % every == 0 and not isnan(guess.string_rad):
                r.pull[count - 1] = self._pull(patch, place, guess)
            if self.unsteady or count % every == 1:
                self._measure_string(frame, place, shift)
        elif not repeated:
            self.hidden += 1
            if self.hidden == 2:
                self._refit()
        if len(r.index) == len(self.first):
            self._look_back(self.first)
            self.first = []

    def _moved(self, place: Place) -> bool:
        """Is the bob farther from where it was on the picture before than it could be found on the same one?"""
        r = self.record
        return r.ok[-1] and hypot(place.x_px - r.place[-1].x_px, place.y_px - r.place[-1].y_px) > 1.0

    def _measure(self, frame: Frame, guess: Guess) -> tuple[Place, Patch | None]:
        """Where the bob is, looked for at the guess, then around it; and the patch that shows it, None where what was found is
        not believed."""
        patch = self._patch(frame, self.look, guess)
        place = NOWHERE if patch is None else self._locate(patch, guess)
        believed = patch is not None and self._believe(place, guess)
        dim = abs(place.light - self._light) > _DIM * self._light
        if patch is not None and self.look.even and (not believed or dim or place.misfit > _ODD * self.ordinary_misfit):
            other = self._before_passer(patch, place if believed and not dim else guess, guess)
            if other is not None and not (believed and other[0].misfit > (1.0 if dim else _BETTER) * place.misfit):
                (place, patch), believed = other, True
        if patch is None or not believed:
            found = self._look_around(frame, guess)
            if found is None:
                return place, None
            place, patch = found
        again = self._beside_shadow(self.localiser, frame, guess, place)
        if again is not None and self._believe(again[0], guess):
            place, patch = again
        return place, patch if self._stands_out(patch, place, guess) else None

    def _before_passer(self, patch: Patch, about: Place | Guess, guess: Guess) -> tuple[Place, Patch] | None:
        """The place before something that passes behind, and that was not there when the background was learned: as if what is
        seen about the bob went on behind it. None where that is not believed to be the bob."""
        found: tuple[Place, Patch] | None = None
        for _ in range(2):  # the first place may be off by as much as the guess
            near = guess._replace(x_px=about.x_px, y_px=about.y_px)
            there = surroundings(patch, self.look_at(near), near)
            if there is None:
                return None
            about = place = self._locate(there, near)
            # what is of the bob's brightness may as well pass before it
            told = np.abs(there.back - place.contrast - place.wall) > 4 * place.misfit
            if not self._believe(place, guess) or np.mean(told) < _FACES or abs(place.light - 1) > _DIM:
                return None
            found = place, there
        return found

    def _locate(self, patch: Patch, guess: Guess) -> Place:
        if not self.look.even:
            return self._locate_uneven(patch, guess)
        if not self.hidden and len(self.recent) == 3:
            place = self.localiser.locate(patch, self.look_at(guess), guess)
            if isfinite(place.x_px):
                return place
        look = self.look_at(guess)
        wide = fit_disc(patch, look._replace(noise=np.inf), guess, soften=2.5, turns=12)
        if wide is not None:  # beside a shadow, a wide look may find nothing where a close one does
            guess = guess._replace(x_px=wide[0] + patch.x_px, y_px=wide[1] + patch.y_px)
        return self.localiser.locate(patch, look, guess)

    def _locate_uneven(self, patch: Patch, guess: Guess) -> Place:
        """A bob with a pattern: the localiser, where it sees enough of the outline; else its silhouette says about where, and the
        localiser, if it agrees, how exactly."""
        look = self.look
        sure = self.localiser.locate(patch, look, guess)
        self._outlined = sure.visible
        if (
            self.bold
            or not self.localiser.circle
            or (sure.visible >= self._least_visible() and 0.25 < sure.contrast / look.contrast < 4.0)
        ):
            return sure
        found = self._outline_in(patch, 0.45)
        if found is None:
            return sure
        x, y, share = found
        place = self.localiser.locate(patch, look, guess._replace(x_px=x, y_px=y))
        believed = {"misfit": self.ordinary_misfit, "visible": min(1.0, share / 0.6), "contrast": look.contrast}
        if np.hypot(place.x_px - x, place.y_px - y) < 0.1 * look.radius_px + 0.5:
            self._outlined = place.visible
            return place._replace(**believed)
        self._outlined = 0.0
        sigma = 0.03 * look.radius_px + 0.1
        return Place(x, y, sigma, sigma, **believed)

    def _look_around(self, frame: Frame, guess: Guess) -> tuple[Place, Patch] | None:
        """Not where it should be: the bob's outline near there, the farther the longer it was not seen and the faster it is
        (a lost frame); now and then wherever it has been. None where no such outline is believed to be the bob."""
        look = self.look
        way = min(self.interval_s * self._speed, 6 * look.radius_px)
        reach = min(6.0, 1.0 + 0.5 * self.hidden) * look.radius_px + 4 + way
        wide = self._patch(frame, look._replace(radius_px=look.radius_px + reach / 1.25), guess)
        found = None if wide is None else self._outline_in(wide)
        if found is None and self.hidden % _SEARCH_EVERY == _SEARCH_EVERY - 1:
            wide = self._wherever_it_was(frame)
            found = None if wide is None else self._outline_in(wide)
        if wide is None or found is None:
            return None
        places = [found[:2]]
        if self.shadow is not None:  # it may be the shadow's
            places.append((found[0] - self.shadow.right_px, found[1] - self.shadow.down_px))
        px, py = self.swing.pivot_px
        least = min(0.9, self._least_visible() + 0.05)
        for x, y in places:
            near = guess._replace(x_px=x, y_px=y)
            close = self._patch(frame, look, near)
            if close is None:
                continue
            other = self._locate(close, near)
            off_arc = abs(np.hypot(other.x_px - px, other.y_px - py) - self.swing.length_px)
            like = other.visible >= least and 0.6 < other.contrast / look.contrast < 1.6
            on_arc = off_arc < 0.5 * look.radius_px + 2 + 2 * self.swing.rms_px
            if like and on_arc and self._believe(other, near):
                return other, close
        return None

    def _outline_in(self, wide: Patch, least: float = 0.6) -> tuple[float, float, float] | None:
        """The centre of the best outline of the bob's size before the background, and how much of the circle was seen; None
        where that is less than `least`."""
        look = self.look
        if look.even:
            picture, sign = wide.image - light_on(wide) * wide.back, 1 if look.contrast > 0 else -1
        else:
            picture, sign = silhouette(wide.image, wide.back), 1
        found = find_round_near(picture, look.radius_px, sign, look.edge_px)
        return None if found is None or found[2] < least else (found[0] + wide.x_px, found[1] + wide.y_px, found[2])

    def _wherever_it_was(self, frame: Frame) -> Patch | None:
        """The part of the picture in which the bob has been."""
        r = self.record
        places = [*self.found.values(), *((p.x_px, p.y_px) for p, ok in zip(r.place, r.ok) if ok)]
        low, high = np.min(places, axis=0), np.max(places, axis=0)
        middle, half = (low + high) / 2, (high - low) / 2 + 2 * self.look.radius_px
        return self._patch(
            frame, self.look, Guess(float(middle[0]), float(middle[1])), (float(half[0]), float(half[1]))
        )

    def _shade_now(self, place: Place) -> float:
        """The bob's brightness in the light of when the background was learned: the wall beside it is darker or brighter now
        because the light is, or because something else stands there; whichever leaves the bob as it was. In doubt the light
        has changed since the bob was seen last as the whole picture has."""
        seen = place.contrast + place.wall
        if isnan(self._shade):
            return seen / place.light
        shade = min((seen / place.light, seen), key=lambda s: abs(s - self._shade))
        before, picture = self._lit
        if abs(shade - self._shade) < 0.1 * abs(self.look.contrast) or picture is None or self._picture is None:
            return shade
        whole = float(np.median(thinned(self._picture) / np.maximum(thinned(picture), 1.0)))
        return min(shade, self._shade * seen / max(before * whole, 1.0), key=lambda s: abs(s - self._shade))

    def _least_visible(self) -> float:
        """How much of the outline must be seen of a bob as fast as it is now."""
        (slow, fast), (at_slow, at_fast) = self.ordinary_visible
        part = (self._speed - slow) / (fast - slow) if fast > slow else 1.0
        return at_slow + (at_fast - at_slow) * min(max(part, 0.0), 1.0)

    def _believe(self, place: Place, guess: Guess) -> bool:
        look = self.look
        if not isfinite(place.x_px):
            return False
        ratio = place.contrast / look.contrast
        self._shade_seen = self._shade_now(place)
        shade = abs(self._shade_seen - self._shade)
        if isnan(place.wall) or not look.even:  # a bob with a pattern shows now this side, now that
            bright = self.bold or 0.25 < ratio < 4.0
        elif isnan(shade) or self.hidden > 15:
            bright = 0.5 < ratio / place.light < 2.0
        else:  # before something of another shade the contrast is another, but the bob is as bright as ever
            clear = abs(ratio) > 0.3 or abs(place.contrast) > 5 * place.misfit
            bright = clear and shade < 0.1 * abs(look.contrast) + 3 * self._shade_scatter
        misfit = place.misfit / max(place.light, 1.0)
        return bool(
            bright
            and place.visible >= self._least_visible()
            and misfit < 2 * self.ordinary_misfit + 0.03 * abs(look.contrast)
            and hypot(place.x_px - guess.x_px, place.y_px - guess.y_px) < 0.6 * look.radius_px + 2
            and self._shows(place)
        )

    def _shows(self, place: Place) -> bool:
        """Does enough of the bob show beside what stands before it? The disc fit leaves the rest out, other localisers do not."""
        if self.front is None:
            return True
        seen_so = self.front, place.x_px, place.y_px, self.look.radius_px
        return enough_shows(*seen_so) if self.localiser.name == "disc" else hidden_share(*seen_so) < 0.1

    def _stands_out(self, patch: Patch, place: Place, guess: Guess) -> bool:
        """Does the picture show the bob, and not what is known to stand still where it is? Half behind a post of about its own
        brightness it seems whole. It is not believed where a third of it could not be told from what is there without it,
        or where a quarter of what could be told is not the bob's."""
        if not self.look.even:
            self._unlike_seen = self._unlike(patch, place)
            # one of two faces may be like the wall: then nearly half of the bob differs, and its outline is seen all around, unless
            # the disc fit says so, which leaves out what hides it
            around = self._outlined >= _AROUND and self.localiser.name != "disc"
            return not np.all(self._unlike_seen < (_FACE if around else _TELLS) * self._usually_unlike)
        shade, radius = self._shade, self.look_at(Guess(place.x_px, place.y_px)).radius_px
        if isnan(shade) or not isfinite(place.wall):
            return True
        light = max((place.contrast + place.wall) / self._shade_seen, 0.1)
        least = 2 * self.look.noise + 0.05 * abs(self.look.contrast)
        disc, streak = (place.x_px, place.y_px, radius), (guess.streak_x_px, guess.streak_y_px)
        # without the bob's own shadow
        told = tell_bob(patch, self.back.mean, self.front, disc, shade, light, least, streak)
        if told is None or told.seen < 8:  # at the picture's rim
            return True
        return told.tells > _TELLS * told.seen and told.bobs > 0.75 * told.tells

    def _unlike(self, patch: Patch, place: Place) -> np.ndarray:
        """How much of a bob with a pattern differs from what stands still where it is: differs much, and differs clearly."""
        radius = self.look.radius_px
        light = light_on(patch)
        behind = _back_at(patch, place, radius, WITHIN) * light
        shown = _back_at(patch._replace(back=patch.image), place, radius, WITHIN)
        # a face of nearly the wall's brightness differs clearly from what is there without it, if little else beside it does
        clear = max(4.0, 4 * rim_level(np.abs(patch.image - light * patch.back)))
        much = 0.2 * abs(self.look.contrast) + 4
        off = np.abs(shown - behind)
        return np.array([np.mean(off > much), np.mean(off > min(clear, much))]) if behind.size else np.full(2, nan)

    def _remember(self, t_s: float, place: Place) -> None:
        """What the next frames are judged by."""
        self.hidden = 0
        self.recent.append((t_s, place.x_px, place.y_px))
        if not self.look.even:  # a bob with a pattern has no one brightness
            share = self._unlike_seen
            self._usually_unlike = share if isnan(self._usually_unlike[0]) else 0.9 * self._usually_unlike + 0.1 * share
        if isnan(place.wall) or not self.look.even:
            return
        shade = self._shade_seen
        self._light = place.light if isnan(self._light) else self._light + 0.1 * (place.light - self._light)
        if self._picture is not None:
            self._lit = (place.contrast + place.wall, self._picture)
        if isnan(self._shade):
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
        kept = self.recent, self.hidden, self._picture
        self.recent = deque(maxlen=kept[0].maxlen)
        for k in reversed(range(len(frames))):
            frame = frames[k]
            if r.ok[k]:
                self.recent.append((frame.t_s, r.place[k].x_px, r.place[k].y_px))
                self.hidden = 0
            elif self.recent and not r.repeated[k]:
                self._picture = frame
                place, patch = self._measure(frame, self._ahead(frame))
                if patch is not None:
                    r.place[k], r.ok[k] = place, True
                    self._remember(frame.t_s, place)
                else:
                    self.hidden += 1
        self.recent, self.hidden, self._picture = kept

    def _ahead(self, frame: Frame, found: tuple[float, float] | None = None) -> Guess:
        """Where the bob should be on the frame, or was `found`, and its streak."""
        x, y, vx, vy = self._expect(frame.t_s)
        self._speed = hypot(vx, vy)
        # else the motion ran away: no bob crosses the picture in a frame
        if not self._speed * self.interval_s < max(self.shape):
            self._speed = vx = vy = 0.0
        return self._guess(*(found or (x, y)), vx, vy, self.exposure_s)

    def _expect(self, t: float) -> tuple[float, float, float, float]:
        """Where the bob should be at time t and how fast, px and px/s: the fitted motion, moved by how far the bob was
        from it in the last frames, or was on the whole if its pattern draws its place to and fro."""
        recent = list(self.recent)[0 if self.bold else -2 :]
        if recent and abs(t - self.swing.t0_s) > 1.0:  # start anew from near by, so that no long way is integrated
            self.swing = replace(self.swing, values=self.swing.values_at(recent[-1][0]), t0_s=recent[-1][0])
        v = self.swing.values.tolist()
        theta, rate = self.swing.angles_at([*(r[0] for r in recent), t])
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
        if self.bold:
            ox, oy = (sum(part) / len(offs) for part in zip(*offs))
        elif len(recent) == 2 and not self.hidden and recent[1][0] != recent[0][0]:
            lead = min(1.0, far / (recent[1][0] - recent[0][0]))
            ox, oy = ox + lead * (ox - offs[0][0]), oy + lead * (oy - offs[0][1])
        self.astray = hypot(ox, oy)
        return x + ox, y + oy, vx, vy

    def _refit(self) -> None:
        """Fit the motion to what was measured last, and found ahead of that, to see through a gap."""
        r = self.record
        self._fitted_at = len(r.index)
        good = [k for k in range(max(0, len(r.ok) - 600), len(r.ok)) if r.ok[k]]
        if len(good) < 20:
            return
        points = [(r.t_s[k], r.place[k].x_px, r.place[k].y_px) for k in good]
        points += [(f.t_s, *self.found[f.index]) for f in self.first[len(r.index) :] if f.index in self.found]
        t, x, y = np.array(points).T
        for start in (self.swing.values_at(t[0]), start_swing(t, x, y)):
            swing = None if start is None else fit_swing(t, x, y, np.full(t.size, 0.5), start, prior=CALM)
            if swing is not None and swing.rms_px < 0.25 * self.look.radius_px + 1:
                self.swing = swing
                return

    def _update_background(self, patch: Patch, place: Place, guess: Guess) -> None:
        rows, columns = patch.image.shape
        dx, dy = patch.x_px - round(patch.x_px), patch.y_px - round(patch.y_px)
        if abs(dx) > 0.2 or abs(dy) > 0.2:
            return  # a shaken frame that lies between the background's pixels would blur it
        x0, y0 = round(patch.x_px), round(patch.y_px)
        if x0 < 0 or y0 < 0 or x0 + columns > self.shape[1] or y0 + rows > self.shape[0]:
            return
        streak = 0.5 * hypot(guess.streak_x_px, guess.streak_y_px)
        keep_out = 1.05 * self.look.radius_px + 3 * self.look.edge_px + 1 + streak
        box = (x0, y0, x0 + columns, y0 + rows)
        self.back.add(patch.image, box, self._dark(place.x_px, place.y_px, keep_out), self.pivot or self.swing.pivot_px)

    def _pull(self, patch: Patch, place: Place, guess: Guess) -> tuple[float, float]:
        """How far it is from where it is found with as much left out opposite the string: an outline that is no circle (a lens, a
        near camera, a rolling shutter), or one of another size, pulls only what sees more of it on one side."""
        near = guess._replace(x_px=place.x_px, y_px=place.y_px, faces=True)
        even = self.localiser.locate(patch, self.look_at(near), near)
        return place.x_px - even.x_px, place.y_px - even.y_px

    def _measure_string(self, frame: Frame, place: Place, shift: CameraShift) -> None:
        px, py = self.pivot or self.swing.pivot_px
        dx, dy = shift.at(place.x_px, place.y_px)
        qx, qy = shift.at(px, py)
        bob = (place.x_px + dx, place.y_px + dy)
        before = None if self.unsteady else self._string
        line = measure_string(frame.luma, bob, (px + qx, py + qy), self.look.radius_px, self.unsteady, before)
        self._string = line
        if self.unsteady:  # what a hand makes of a small swing tells no direction: or about straight down
            other = measure_string(frame.luma, bob, (bob[0], 0.0), self.look.radius_px)
            line = max((one for one in (line, other) if one is not None), key=lambda one: one.strength, default=None)
        if line is not None:
            sx, sy = shift.at(line.x_px, line.y_px)
            self.record.string[len(self.record.index) - 1] = (
                line.x_px - sx,
                line.y_px - sy,
                line.angle_rad + shift.roll_rad,
                line.sigma_angle_rad,
                line.sigma_px,
            )


def _back_at(patch: Patch, place: Place, reach_px: float, offsets: np.ndarray) -> np.ndarray:
    """The background's brightness at these (2, n) offsets from a place, in units of `reach_px`, as far as the patch reaches."""
    x, y = place.x_px - patch.x_px, place.y_px - patch.y_px
    columns, rows = np.rint(reach_px * offsets + np.array([[x], [y]])).astype(int)
    height, width = patch.back.shape
    if not (reach_px <= x <= width - 1 - reach_px and reach_px <= y <= height - 1 - reach_px):
        inside = (columns >= 0) & (rows >= 0) & (columns < width) & (rows < height)
        columns, rows = columns[inside], rows[inside]
    return patch.back[rows, columns]
