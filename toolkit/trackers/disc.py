"""Disc fit with motion blur: least squares of a shaded disc with a soft edge, smeared along its motion, over the
background that the clip has shown, on a ring of pixels about the outline and, where the bob is evenly shaded, a quarter
of those within it (they tell the shade, which the outline alone confuses with the place).

Model of a pixel: g·back·(1 − α) + (f0 + fx·dx/R + fy·dy/R)·α, with α the mean over the streak of the edge function
E((R − d)/h). The streak is a parabola: string and gravity bend the bob's way. E is the integral of a compact kernel very
near to the normal distribution's: no exponential to evaluate.
Gauss–Newton over (cx, cy, f0, fx, fy, g) and, when calibrating, (R, h); pixels far off the model do not count.
"""

from __future__ import annotations

import threading
from ctypes import addressof, create_string_buffer
from functools import cache
from math import cos, isnan, sin, sqrt
from struct import Struct
from typing import Any

import numpy as np

from toolkit.motion.compiled import address
from toolkit.trackers.localiser import NOWHERE, Guess, Localiser, Look, Patch, Place


def fit_disc(
    patch: Patch, look: Look, guess: Guess, *, calibrate: bool = False, turns: int = 7, soften: float = 1.0
) -> np.ndarray | None:
    """(cx, cy, R, s, var_x, var_y, cov_xy, misfit, visible, contrast, gain, pixels, wall, misfit well inside) in patch
    pixels, or None.

    `calibrate` lets radius and edge go free; `soften` widens the edge, and with it the range of capture.
    """
    plain = soften == 1.0
    free = 8 if calibrate else 7 if look.radius_free and plain else 6
    out = _fit(patch, look, guess, free, turns, soften, look.contrast if plain else 0.0)
    return None if out is None else np.array(out)


def locate(patch: Patch, look: Look, guess: Guess) -> Place:
    """The bob's centre by the disc fit; radius and edge are those of `look`."""
    out = _fit(patch, look, guess, 7 if look.radius_free else 6, 7, 1.0, look.contrast)
    if out is None or out[4] <= 0 or out[5] <= 0:
        return NOWHERE
    cx, cy, _, _, xx, yy, _, misfit, visible, contrast, gain, _, wall, _ = out
    light = min(max(gain, 0.3), 3.0) if wall > 1.0 else 1.0
    return Place(cx + patch.x_px, cy + patch.y_px, sqrt(xx), sqrt(yy), misfit, visible, contrast, gain * wall, light)


_GIVEN, _FOUND, _PLACES = Struct("13d"), Struct("14d"), Struct("15q")  # what the kernel takes and gives, and its places
_SPARE = 4096  # numbers that it needs beside its seven lists of pixels, and more
_SINGLE = np.dtype(np.float32)


class _Desk(threading.local):
    """What one thread works on from frame to frame."""

    def __init__(self) -> None:
        self.numbers = create_string_buffer(_GIVEN.size + _FOUND.size)
        self.places = create_string_buffer(_PLACES.size)
        self.room = np.empty(0)
        self.at = addressof(self.places)
        self.numbers_at, self.room_at = addressof(self.numbers), 0

    def provide(self, pixels: int) -> None:
        if self.room.size < 7 * pixels + _SPARE:
            self.room = np.empty(7 * pixels + _SPARE)
            self.room_at = self.room.ctypes.data


_desk = _Desk()


def _plain(picture: np.ndarray) -> np.ndarray:
    """The same with float32 pixels that lie one beside the other in each row."""
    plain = picture.dtype is _SINGLE and picture.strides[1] == 4
    return picture if plain else np.ascontiguousarray(picture, np.float32)


def _start(picture: np.ndarray) -> int:
    """Where its pixels begin."""
    return address(picture[0]) if picture.flags.writeable else picture.ctypes.data


@cache
def _kernel() -> Any:
    from toolkit.motion.compiled import kernel

    return kernel("fit", "toolkit.trackers._disc_kernel", "the disc fit")


def _fit(
    patch: Patch, look: Look, guess: Guess, free: int, turns: int, soften: float, contrast: float
) -> tuple[float, ...] | None:
    desk, (rows, columns) = _desk, patch.image.shape
    desk.provide(rows * columns)
    string = 0.0, 0.0, 1.0
    if not isnan(guess.string_rad):
        wedge = cos(min(0.9, 0.2 + 3.0 / look.radius_px)) ** 2
        string = cos(guess.string_rad), sin(guess.string_rad), -wedge if guess.faces else wedge
    _GIVEN.pack_into(
        desk.numbers, 0, guess.x_px - patch.x_px, guess.y_px - patch.y_px, look.radius_px, look.edge_px * soften,
        guess.streak_x_px, guess.streak_y_px, guess.bend_x_px, guess.bend_y_px, *string, look.noise, contrast,
    )  # fmt: skip
    image, back, seen = _plain(patch.image), _plain(patch.back), _plain(patch.seen)
    _PLACES.pack_into(
        desk.places, 0, _start(image), _start(back), _start(seen), desk.numbers_at, desk.room_at, rows, columns,
        image.strides[0] // 4, back.strides[0] // 4, seen.strides[0] // 4, free, look.even, turns, rows * columns, 0,
    )  # fmt: skip
    _kernel()(desk.at + _PLACES.size - 8, None, desk.at)
    out = _FOUND.unpack_from(desk.numbers, _GIVEN.size)
    return None if isnan(out[0]) else out


LOCALISER = Localiser(
    "disc", "least squares of a shaded disc with a soft edge and motion blur (default)", locate, circle=True
)
