"""What a localiser of the bob is. One localiser is one module of this package with a module-level `LOCALISER`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np


class Patch(NamedTuple):
    """The piece of a frame around the bob, all arrays (h, w) float32.

    image : the frame (luma, or the colour projection in which the bob stands out).    back : what the picture is
    without the bob.    seen : in how many frames each pixel of `back` was seen; 0 where it is only a guess, negative where
    something stands before the bob's way: such pixels tell nothing.
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
    and the direction from the bob to the string (radians, image axes; NaN if no string is to be expected). Where it `faces` it,
    the outline is left out as far on the other side of the bob as at the string. The streak bends: at the part u of the exposure,
    −½ to ½, the bob is streak·u + bend·u² from where it is in the middle, the bend being half its acceleration times the exposure
    squared."""

    x_px: float
    y_px: float
    streak_x_px: float = 0.0
    streak_y_px: float = 0.0
    string_rad: float = np.nan
    faces: bool = False
    bend_x_px: float = 0.0
    bend_y_px: float = 0.0


class Place(NamedTuple):
    """Where the bob was found. `misfit` is what the localiser's idea of the bob leaves unexplained of the picture (rms, grey
    levels): by it the pipeline chooses between localisers. `visible` is the fraction of the outline that was seen, `contrast`
    bob minus wall, `wall` the level of the wall if it was measured, `light` how bright the light on it is against that when the
    background was learned. A localiser that finds nothing returns NaN for x and y."""

    x_px: float
    y_px: float
    sigma_x_px: float
    sigma_y_px: float
    misfit: float
    visible: float
    contrast: float
    wall: float = np.nan
    light: float = 1.0


def disc_share(distance: np.ndarray, look: Look) -> np.ndarray:
    """How much a disc at rest covers of a pixel so far from its centre (px): its edge is the integral of a compact kernel
    that is very near to a normal distribution."""
    v = np.clip((look.radius_px - distance) / (2.6458 * look.edge_px), -1, 1)
    return np.asarray(0.5 + 0.9375 * v * (1 - v * v * (2 / 3 - 0.2 * v * v)))


def unexplained(patch: Patch, look: Look, guess: Guess, x: float, y: float) -> float:
    """What an even disc at (x, y) of the patch, smeared along its way, leaves of the picture on it and about it (rms, grey
    levels): the misfit of a localiser that takes the bob for one shade but fits no model."""
    rows, columns = np.ogrid[: patch.image.shape[0], : patch.image.shape[1]]
    streak = np.hypot(guess.streak_x_px, guess.streak_y_px)
    parts = np.linspace(-0.5, 0.5, 1 + int(np.ceil(streak)))
    ways = [
        np.hypot(columns - x - u * guess.streak_x_px, rows - y - u * guess.streak_y_px) for u in parts * (streak > 0)
    ]
    near = np.min(ways, axis=0) < look.radius_px + 3 * look.edge_px
    share = np.mean([disc_share(d[near], look) for d in ways], axis=0)
    picture = (patch.image - patch.back)[near]
    rest = picture - share * (picture @ share) / max(float(share @ share), 1e-9)
    return float(np.sqrt(np.mean(rest**2)))


NOWHERE = Place(np.nan, np.nan, np.nan, np.nan, np.nan, 0.0, 0.0)


@dataclass(frozen=True)
class Localiser:
    """A way to find the bob's centre in a patch. `summary` is one sentence for the list of trackers; one that takes the bob for a
    `circle` sees its outline, any other the middle of what is like it."""

    name: str
    summary: str
    locate: Callable[[Patch, Look, Guess], Place]
    circle: bool = False
