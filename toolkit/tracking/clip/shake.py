"""The camera's shake over the whole clip, smoothed as far as its own noise asks for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from toolkit.sentence import said
from toolkit.tracking.clip.places import Places
from toolkit.tracking.clip.string_shake import shake_on_string
from toolkit.tracking.follow import Follower
from toolkit.tracking.geometry.swing import Swing, fit_swing
from toolkit.tracking.geometry.view_fit import Lines
from toolkit.tracking.picture.stillness import CameraShift

_EVENER = 0.7  # times what places stray from a swing: less, without the shake, and there was none
_CHECKS = 4  # looks at the background that it takes to say that the camera stood still


class Shake:
    """How far the camera's shake moved the bob's place on each frame, smoothed as far as its own noise asks for.

    raw_x, raw_y (n,) were taken away while following (0 where the camera seemed to stand still), x, y (n,) are to be, which leaves each
    frame `sigma` (n,) px. `taken` is False where the camera stood still as far as could be seen; then it may have moved by `unseen_px`.
    `by_string` is True where not the background told it but the string.
    """

    def __init__(self, follower: Follower, good: np.ndarray) -> None:
        r = follower.record
        n = len(r.index)
        self.raw_x, self.raw_y, self.sigma = np.zeros(n), np.zeros(n), np.zeros(n)
        self.x, self.y = self.raw_x, self.raw_y
        self.extent_px = np.zeros(2)
        self.taken = follower.shaking
        self.by_string = False
        checks = [np.hypot(s.x_px, s.y_px) + 3 * s.sigma_px for s in follower.checks.values()]
        self.unseen_px = float(np.max(checks)) if len(checks) >= _CHECKS and not self.taken else np.inf
        row = {index: k for k, index in enumerate(r.index)}
        known: dict[int, CameraShift] = {row[i]: s for i, s in follower.checks.items() if i in row}
        known |= {k: s for k, s in enumerate(r.shift) if s is not None}
        if not follower.shaking or not known:
            return
        at = np.array(sorted(known))
        rows = np.array([known[k][:3] for k in at])
        shifts = np.column_stack([np.interp(np.arange(n), at, column) for column in rows.T])
        first = next(k for k in range(n) if r.shift[k] is not None)
        smooth, noise = shifts.copy(), np.zeros(3)
        stated = np.median([(s.sigma_px, s.sigma_px, s.roll_sigma_rad) for s in known.values()], axis=0)
        for k in range(3):  # each by itself: a roll is measured in other units, and changes at its own pace
            smooth[first:, k], noise[k] = _smoothed(shifts[first:, k], stated[k])
        one = next(iter(known.values()))
        self.x, self.y = np.zeros(n), np.zeros(n)
        for k, p in enumerate(r.place):
            where = (p.x_px, p.y_px) if good[k] else (one.centre_x_px, one.centre_y_px)
            self.x[k], self.y[k] = one._replace(x_px=smooth[k, 0], y_px=smooth[k, 1], roll_rad=smooth[k, 2]).at(*where)
            if k >= first:
                self.raw_x[k], self.raw_y[k] = r.shift[k].at(*where)  # type: ignore[union-attr]
        apart = [
            (p.x_px - one.centre_x_px, p.y_px - one.centre_y_px) if ok else (0.0, 0.0) for p, ok in zip(r.place, good)
        ]
        self.sigma = np.sqrt(0.5 * (noise[0] ** 2 + noise[1] ** 2 + noise[2] ** 2 * np.sum(np.square(apart), axis=1)))
        self.extent_px = np.ptp(shifts, axis=0)[:2]

    def look_at_string(self, places: Places, lines: Lines) -> None:
        """Where the background shows no shake, let the string's lines tell it."""
        found = None if self.taken else shake_on_string(places, lines)
        if found is not None:
            (self.x, across), (self.y, down) = (_smoothed(column, float(np.median(found[1]))) for column in found[0].T)
            self.sigma = np.maximum(found[1], np.hypot(across, down) / np.sqrt(2))
            self.extent_px = np.array([np.ptp(self.x), np.ptp(self.y)])
            self.taken = self.by_string = True

    def told(self, left_px: float = 0.0) -> list[str]:
        """A sentence on the shake that was taken away, if any, and on what of it was left."""
        if not (self.taken and self.extent_px.any()):
            return []
        if self.by_string:
            return [
                said(
                    "track.shake_by_string",
                    "The camera moved by up to {across_px:.1f} px across and {down_px:.1f} px down before a wall that shows nothing; "
                    "this was measured on the string and taken away. What is left, {left_px:.2f} px (a roll of the camera turns the "
                    "string too), is in the error bars of the angles.",
                    across_px=float(self.extent_px[0]),
                    down_px=float(self.extent_px[1]),
                    left_px=left_px,
                )
            ]
        return [
            said(
                "track.shake",
                "The camera moved by up to {across_px:.1f} px across and {down_px:.1f} px down; this was measured on the still "
                "background (to {noise_px:.3f} px a frame) and taken away.",
                across_px=float(self.extent_px[0]),
                down_px=float(self.extent_px[1]),
                noise_px=float(np.median(self.sigma)),
            )
        ]

    def checked(self, places: Places, swing: Swing) -> tuple[Places, Swing]:
        """The places and their motion as they are; or, where the bob swings more evenly without it, as they were before the
        shake was taken away: then it was none, but a light that changed or an object that moved."""
        some = places.some()
        x, y = places.x_px + self.x, places.y_px + self.y
        still = fit_swing(
            places.t_s[some], x[some], y[some], np.full(some.size, 0.1), swing.values_at(places.t_s[some[0]])
        )
        if still is None or still.rms_px > _EVENER * swing.rms_px:
            return places, swing
        self.x, self.y, self.sigma = np.zeros_like(x), np.zeros_like(y), np.zeros_like(x)
        self.taken = self.by_string = False
        return replace(places, x_px=x, y_px=y), still


def _smoothed(values: np.ndarray, most: float) -> tuple[np.ndarray, float]:
    """`values` (n,) by local parabolas over the window that leaves the least error, as the rest tells it (Mallows's C_p), and that
    error; their noise is `most` at most."""
    n = len(values)
    if n < 12:
        return values, most
    third = values[3:] - 3 * values[2:-1] + 3 * values[1:-2] - values[:-3]
    noise = min(most, float(1.4826 * np.median(np.abs(third)) / np.sqrt(20)))
    best, least = values, noise**2
    for half in (2, 4, 7, 12, 20):
        if half > n // 4:
            break
        kernel = np.linalg.pinv(np.vander(np.arange(-half, half + 1), 3, increasing=True))[0]
        smooth = np.convolve(np.pad(values, half, mode="reflect", reflect_type="odd"), kernel[::-1], "valid")
        share = float(kernel[half])  # of the noise's variance that is left, and by how much the rest has less
        error = max(float(np.mean((values - smooth) ** 2)) - noise**2 * (1 - 2 * share), noise**2 * share)
        if error < least:
            best, least = smooth, error
    return best, float(np.sqrt(least))
