"""What stands before the bob's way (a post, the stand's foot): there the picture goes on as if no bob were, while it should
be covered by it. Without it the piece of the bob that still shows, or the post's rim, would be taken for the bob.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from toolkit.trackers.disc import fit_disc
from toolkit.trackers.localiser import Guess, Look, Patch
from toolkit.tracking.picture.background import Background
from toolkit.tracking.picture.looks import light_on

EVEN = 0.08  # of the bob's contrast: less misfit is an even disc's
_HARMONICS = 2
_TURNS = 12
_UNLIKE, _CLEARLY = 0.3, 6.0  # of the bob's contrast; of the noise: what differs less from it than both tells nothing
_WELL_WITHIN = 0.85  # of the radius
_OFTEN = 3  # frames
_LARGE = 0.1  # of the bob's disc
_RIM = 5  # px: the picture is blurred
_THIRD, _HALF = 0.35, 0.55  # of the bob: with more hidden too little is left of its outline
_LONG = 0.25  # of the outline

_TURN = np.arange(100) * np.pi * (3 - np.sqrt(5))
WITHIN = np.sqrt((np.arange(100) + 0.5) / 100) * np.stack([np.cos(_TURN), np.sin(_TURN)])
"""A sunflower's places, (2, n): even over the unit disc."""
ROUND = np.stack([np.cos(np.arange(32) * np.pi / 16), np.sin(np.arange(32) * np.pi / 16)])
"""Places on its outline."""

Show = Callable[[int, float, float], tuple[Guess, Patch | None]]
"""Frame i with the bob guessed at x, y (px): the guess and the patch."""
# what `fit_disc` gives
_RADIUS, _EDGE, _MISFIT, _VISIBLE, _CONTRAST, _WALL = 2, 3, 7, 8, 9, 12


@dataclass(frozen=True)
class Rhythm:
    """A bob's way as its first harmonics: less than a pendulum, but it holds for an ellipse before a tilted camera too.

    off_px : (n,) how far the points are from it.
    """

    t0_s: float
    rate: float
    amplitudes: np.ndarray
    off_px: np.ndarray

    @classmethod
    def through(cls, t_s: np.ndarray, fits: Mapping[int, np.ndarray], period_s: float) -> Rhythm:
        """Through the points (x, y, …) at times t_s[i], of which many may be wrong; `period_s` may be off by a fifth."""
        t, points = t_s[list(fits)] - t_s[0], np.array([fit[:2] for fit in fits.values()])
        calm = np.diag([1e-9] * 3 + [0.3] * 2 * (_HARMONICS - 1))
        rates = 2 * np.pi / period_s * np.linspace(0.8, 1.25, 46)
        waves = _waves(rates[:, None] * t)  # all rates at once: (rates, n, amplitudes)
        weight = np.ones(waves.shape[:2])
        for _ in range(_TURNS):
            weighted = (waves * weight[..., None]).swapaxes(1, 2)
            amplitudes = np.linalg.solve(weighted @ waves + calm, weighted @ points)
            off = np.hypot(*np.moveaxis(points - waves @ amplitudes, 2, 0))
            near = 1.5 * np.maximum(0.3, np.median(off, axis=1, keepdims=True))
            weight = (1 + (off / near) ** 2) ** -2
        best = int(np.argmin(np.log1p(off**2).sum(axis=1)))
        return cls(float(t_s[0]), float(rates[best]), amplitudes[best], off[best])

    @property
    def strays_px(self) -> float:
        """The median distance of the points from it."""
        return float(np.median(self.off_px))

    @property
    def true(self) -> np.ndarray:
        """(n,) bool: the points that follow it."""
        return np.asarray(self.off_px < max(1.0, 4 * self.strays_px))

    def position(self, t_s: np.ndarray) -> np.ndarray:
        """(n, 2) px at times t_s (n,)."""
        return np.asarray(_waves(self.rate * (t_s - self.t0_s)) @ self.amplitudes)


def _waves(phase: np.ndarray) -> np.ndarray:
    parts = [f((k + 1) * phase) for k in range(_HARMONICS) for f in (np.cos, np.sin)]
    return np.stack([np.ones_like(phase), *parts], axis=-1)


def fit_each(
    show: Show, places: Mapping[int, tuple[float, float]], look: Look, far: bool = True
) -> dict[int, np.ndarray]:
    """The disc of about this look (radius and edge are fitted too) near these places, or just there if not `far`, by the frame;
    where enough of it shows."""
    found = {}
    look = look._replace(noise=np.inf)
    for i, (x, y) in places.items():
        for how in ({"soften": 2.5, "turns": 12}, {"calibrate": True, "turns": 10})[0 if far else 1 :]:
            guess, patch = show(i, x, y)
            fit = None if patch is None else fit_disc(patch, look, guess, **how)
            if patch is not None and fit is not None:
                x, y = fit[:2] = fit[0] + patch.x_px, fit[1] + patch.y_px
        if patch is None or fit is None or fit[_VISIBLE] < 0.5 or not 0.7 < fit[_RADIUS] / look.radius_px < 1.4:
            continue
        if enough_shows(patch.seen < 0, fit[0] - patch.x_px, fit[1] - patch.y_px, look.radius_px):
            found[i] = fit
    return found


def is_clear(fit: np.ndarray) -> bool:
    """Does an even disc before the wall, and nothing else, explain the picture?"""
    return bool(fit[_VISIBLE] > 0.8 and fit[_MISFIT] < EVEN * abs(fit[_CONTRAST]))


def typical(look: Look, fits: list[np.ndarray]) -> tuple[Look, float]:
    """The looks, and the bob's brightness, of the half of the fits that explain their pictures best."""
    table = np.array(fits)
    middle = np.median(table[np.argsort(table[:, _MISFIT])[: max(8, len(fits) // 2)]], axis=0)
    size, edge, contrast, noise, wall = (float(middle[n]) for n in (_RADIUS, _EDGE, _CONTRAST, _MISFIT, _WALL))
    return look._replace(radius_px=size, edge_px=edge, contrast=contrast, noise=noise), wall + contrast


def hidden_share(front: np.ndarray, x: float, y: float, radius_px: float) -> float:
    """How much of a disc at x, y (pixels of `front`, (h, w) bool) is hidden."""
    return float(_hidden(front, x, y, radius_px, WITHIN).mean())


def enough_shows(front: np.ndarray, x: float, y: float, radius_px: float) -> bool:
    """Is a third of the disc hidden at most; or half of it, but of the outline no long piece (a narrow post before its middle)?"""
    share = hidden_share(front, x, y, radius_px)
    if share < _THIRD or share > _HALF:
        return share < _THIRD
    shown, of = np.flatnonzero(~_hidden(front, x, y, radius_px, ROUND)), ROUND.shape[1]
    return bool(shown.size and np.diff(shown, append=shown[0] + of).max() < _LONG * of)


def _hidden(front: np.ndarray, x: float, y: float, radius_px: float, offsets: np.ndarray) -> np.ndarray:
    """(n,) bool: is the disc hidden at these (2, n) offsets from its centre, in units of its radius?"""
    columns, rows = np.rint(radius_px * offsets + np.array([[x], [y]])).astype(int)
    height, width = front.shape
    return np.asarray(front[rows.clip(0, height - 1), columns.clip(0, width - 1)])


def find_front(
    show: Show, places: Mapping[int, tuple[float, float]], back: Background, look: Look, shade: float
) -> np.ndarray | None:
    """(h, w) bool: where something stands before a bob of these looks and this brightness; None where nothing does.

    places : by the frame, where the bob is, whether it is hidden there or not.
    """
    import cv2

    bare, covered = np.zeros(back.mean.shape, np.int16), np.zeros(back.mean.shape, np.int16)
    least = min(_UNLIKE * abs(look.contrast), _CLEARLY * look.noise)
    for i, place in places.items():
        guess, patch = show(i, *place)
        if patch is None:
            continue
        rows, columns = patch.image.shape
        x0, y0 = round(patch.x_px), round(patch.y_px)
        if min(x0, y0) < 0 or x0 + columns > bare.shape[1] or y0 + rows > bare.shape[0]:
            continue  # shaken out of the first frame
        across, down = np.arange(columns) + (x0 - guess.x_px), np.arange(rows)[:, None] + (y0 - guess.y_px)
        away = np.abs(patch.back - shade)
        tells = (np.hypot(across, down) < _WELL_WITHIN * look.radius_px) & (patch.seen > 0) & (away > least)
        alike = np.abs(patch.image / light_on(patch) - patch.back) < 0.4 * away
        window = (slice(y0, y0 + rows), slice(x0, x0 + columns))
        bare[window] += tells & alike
        covered[window] += tells & ~alike
    front = ((bare >= _OFTEN) & (bare > 2 * covered)).astype(np.uint8)
    front = cv2.morphologyEx(front, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    _, pieces, table, _ = cv2.connectedComponentsWithStats(front)
    large = table[:, cv2.CC_STAT_AREA] > _LARGE * np.pi * look.radius_px**2
    large[0] = False
    if not large.any():
        return None
    return np.asarray(cv2.dilate(large[pieces].astype(np.uint8), np.ones((_RIM, _RIM), np.uint8)) > 0)
