"""Localisers tried on the frames read ahead: what each makes of them, and whose places are taken."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from toolkit.sentence import said
from toolkit.trackers.localiser import Localiser, Look, Place
from toolkit.tracking.geometry.swing import Swing, fit_swing
from toolkit.tracking.picture.looks import Looks

_CALM = 1.5  # times as far as another's: places of some forty frames that stray more do so by no chance
_CLEARLY = 1.15  # times as far on the same frames, some fifty: by chance alone it is less
SHOWS = 0.6  # of the outline, at least, where the bob is said to be found


class Trial(NamedTuple):
    """A localiser on the frames read ahead, with the looks it took the bob to have: on how many it finds the bob, the motion fitted
    to its places, and what misfit, how much of the outline (at two speeds) and which brightness of the bob (and scatter of it)
    are ordinary for it."""

    localiser: Localiser
    looks: Looks
    found: int
    swing: Swing
    misfit: float
    visible: tuple[tuple[float, float], tuple[float, float]]
    shade: tuple[float, float]
    strays_px: dict[int, float]  # from the swing, on each frame
    places: dict[int, tuple[float, float, float]]  # time, x and y on each frame

    def calmer_than(self, other: Trial, times: float = 1.0) -> bool:
        """Does the other stray more (than so many times as far), on the frames on which both find the bob?"""
        both = self.strays_px.keys() & other.strays_px.keys()
        mine, its = (sum(trial.strays_px[i] ** 2 for i in both) for trial in (self, other))
        return times**2 * mine < its

    def finds_more_than(self, other: Trial) -> bool:
        """Does it find the bob on more frames, and no less calmly on those on which both find it?"""
        if self.found <= 1.05 * other.found:
            return False
        mine_px, its_px = self.rms_with(other)
        return mine_px <= 1.05 * its_px

    def rms_with(self, other: Trial) -> tuple[float, float]:
        """How far (rms, px) this and the other stray from a swing through the frames on which both find the bob: where a camera looks
        aslant, or where little is seen of the bob, whoever finds it on fewer frames strays less from a swing of its own."""
        both = sorted(self.places.keys() & other.places.keys())
        if len(both) == len(self.places) == len(other.places) or len(both) < 10:
            return self.swing.rms_px, other.swing.rms_px
        strays = []
        for trial in (self, other):
            t, x, y = np.array([trial.places[i] for i in both]).T
            swing = fit_swing(t, x, y, np.full(t.size, 0.1), trial.swing.values_at(t[0]))
            strays.append((swing or trial.swing).rms_px)
        return strays[0], strays[1]


def judge(
    localiser: Localiser,
    looks: Looks,
    places: dict[int, Place],
    t_s: np.ndarray,
    start: Swing,
    looked_at: int,
    shows: float | None = SHOWS,
) -> Trial | None:
    """The trial of a localiser that found the bob at these places, of the frames at t_s (n,), about which it swings as `start` says.
    It looked at so many of them: None where it sees it, or this share of its outline, on too few. Without a share what counts is how much it
    usually sees: it takes the bob for no circle."""
    usual = 1.0 if shows is not None or not places else float(np.median([p.visible for p in places.values()]))
    least = usual * (SHOWS if shows is None else shows)
    places = {i: p for i, p in places.items() if p.visible > least}
    if len(places) < 10 or len(places) <= 0.5 * looked_at:
        return None
    t = t_s[list(places)]
    x, y, misfit, visible = np.array([(p.x_px, p.y_px, p.misfit, p.visible) for p in places.values()]).T
    swing = fit_swing(t, x, y, np.full(t.size, 0.1), start.values_at(t[0]))
    if swing is None:
        return None
    # not beside a frame on which it was not found: something hid a part of it there
    clear = np.array([all(k in places for k in (i - 2, i - 1, i + 1, i + 2) if 0 <= k < t_s.size) for i in places])
    if clear.sum() < 10:
        clear[:] = True
    speeds = np.hypot(*swing.velocity(t))
    ordinary = float(np.percentile(misfit, 90)), _by_speed(speeds[clear], visible[clear], usual)
    shades = np.array([(p.contrast + p.wall) / p.light for p in places.values()])
    shade = float(np.median(shades))
    scatter = 1.4826 * float(np.median(np.abs(shades - shade)))
    strays = np.hypot(*(drawn - at for drawn, at in zip(swing.position(t), (x, y))))
    seen = dict(zip(places, zip(t.tolist(), x.tolist(), y.tolist())))
    far = dict(zip(places, strays.tolist()))
    return Trial(localiser, looks, len(places), swing, *ordinary, (shade, scatter), far, seen)


def take_best(trials: list[Trial], look: Look) -> Trial:
    """Of the trials on a bob that looks so, the one whose model leaves least of the picture unexplained and whose places do not leap."""
    # whatever it explains, what leaps about was not found; what errs alike on all frames does not leap
    calmest, least = min(trials, key=lambda t: t.swing.rms_px), max(0.05, 0.01 * look.radius_px)
    calm = [mine < _CALM * its + least for mine, its in (t.rms_with(calmest) for t in trials)]
    # a model with more freedom leaves less of any picture; what an outline that is no circle leaves hardly moves a bob of one shade
    less = 0.0 if look.even else 0.7
    # a pattern that pulls its place makes the bob waver, however well the picture is explained
    waver = [not look.even and any(other.calmer_than(t, _CLEARLY) for other in trials) for t in trials]
    steady = [t for t, leaps_not, wavers in zip(trials, calm, waver) if leaps_not and not wavers] or trials
    return min(
        (t for t in steady if not any(other.finds_more_than(t) for other in steady)),
        key=lambda t: t.misfit * (less if t.localiser.name == "disc" else 1.0),
    )


def _by_speed(
    speed: np.ndarray, visible: np.ndarray, usual: float = 1.0
) -> tuple[tuple[float, float], tuple[float, float]]:
    """How much of the outline is to be seen at least, at two speeds (px/s): a rolling shutter shears it where the bob is fast,
    and what is seen on nine frames of ten is not hidden."""
    fast = speed > np.median(speed)
    least = [
        float(np.clip(np.percentile(visible[part], 10) - 0.05, 0.65 * usual, 0.85 * usual)) for part in (~fast, fast)
    ]
    return (float(np.median(speed[~fast])), float(np.median(speed[fast]))), (least[0], least[1])


def told_choice(tried: list[Trial], contrast: float) -> str:
    """A sentence on how much of the bob's contrast (grey levels) each leaves unexplained."""
    return said(
        "track.choice",
        "An even disc does not explain the bob. What each localiser leaves unexplained of its contrast: {left}.",
        left=", ".join(
            f"{t.localiser.name} {t.misfit / max(contrast, 1.0):.0%}" for t in sorted(tried, key=lambda t: t.misfit)
        ),
    )
