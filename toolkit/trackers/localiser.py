"""What a localiser of the bob is. One localiser is one module of this package with a module-level `LOCALISER`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np


class Patch(NamedTuple):
    """The piece of a frame around the bob, all arrays (h, w) float32.

    image : the frame (luma, or the colour projection in which the bob stands out).    back : what the picture is
    without the bob.    seen : in how many frames each pixel of `back` was seen; 0 where it is only a guess.
    x_px, y_px : where the patch's first pixel lies (where the camera shakes: in the first frame's pixels).
    """

    image: np.ndarray
    back: np.ndarray
    seen: np.ndarray
    x_px: float
    y_px: float


class Look(NamedTuple):
    """What the clip has told about the bob's looks.

    radius_px, edge_px : radius and standard deviation of its edge.    contrast : bob minus wall, in grey levels.
    noise : typical misfit of a good fit, in grey levels.    template : (k, k) float32 mean picture, or None.
    radius_free : the bob's size changes along its way (perspective, focus): it is to be fitted on every frame.
    even : the bob has one shade, or one that changes evenly across it; False for a pattern or a highlight.
    """

    radius_px: float
    edge_px: float = 1.0
    contrast: float = 0.0
    noise: float = np.inf
    template: np.ndarray | None = None
    radius_free: bool = False
    even: bool = True


class Guess(NamedTuple):
    """Where the bob is expected: centre in the whole frame, the streak (vector) that it draws during the exposure,
    and the direction from the bob to the string (radians, image axes; NaN if no string is to be expected)."""

    x_px: float
    y_px: float
    streak_x_px: float = 0.0
    streak_y_px: float = 0.0
    string_rad: float = np.nan


class Place(NamedTuple):
    """Where the bob was found. `misfit` is the rms of the fit in grey levels, `visible` the fraction of the outline
    that was seen, `contrast` bob minus wall, `wall` the level of the wall if it was measured. A localiser that finds nothing returns NaN for x and y."""

    x_px: float
    y_px: float
    sigma_x_px: float
    sigma_y_px: float
    misfit: float
    visible: float
    contrast: float
    wall: float = np.nan


NOWHERE = Place(np.nan, np.nan, np.nan, np.nan, np.nan, 0.0, 0.0)


@dataclass(frozen=True)
class Localiser:
    """A way to find the bob's centre in a patch. `summary` is one sentence for the list of trackers."""

    name: str
    summary: str
    locate: Callable[[Patch, Look, Guess], Place]
