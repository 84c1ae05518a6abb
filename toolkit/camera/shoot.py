"""Shoot: the plan of one film. Camera effects add to it, `toolkit.render` carries it out.

Every member is a neutral value or an empty list of functions; a new effect uses these and changes nothing here.
Points are (…, 2) arrays of image pixels (x right, y down, first pixel's centre at (0, 0)), colours are display levels
0–255 as red, green, blue, times are scene seconds.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

import numpy as np

Colour = tuple[float, float, float]


@dataclass(frozen=True)
class Patch:
    """A piece of picture laid over what is there: alpha (h, w) from 0 to 1 at columns x0…, rows y0…, in one colour
    (3,) or one a pixel (h, w, 3). It may reach outside the picture."""

    x0: int
    y0: int
    alpha: np.ndarray
    rgb: np.ndarray | Colour


@dataclass(frozen=True)
class View:
    """Where things are on one exposure: its mid time (middle row), the bob's mean position and its radius in pixels, θ,
    and `place`, which turns positions on a still camera's picture into positions on this one (hand shake)."""

    t_s: float
    x_px: float
    y_px: float
    radius_px: float
    theta_rad: float
    place: Callable[[np.ndarray], np.ndarray]


@dataclass
class Shoot:
    """One film in the making. Mutable on purpose: it lives only while effects are applied to it."""

    width_px: int
    height_px: int
    fps: Fraction
    duration_s: float
    px_per_m: float
    pivot_px: tuple[float, float]
    length_m: float
    radius_m: float
    omega_g_rad_per_s: float
    seed: int

    captured_s: np.ndarray  # (n,) when each frame's middle row is at mid exposure; equal neighbours: a frame repeated
    stamped_s: np.ndarray  # (n,) the time stamp that the file gives it
    exposure_s: float = 0.0
    readout_s: float = 0.0  # from the first row to the last

    distance_m: float | None = None  # of the camera; None: from infinity
    yaw_rad: float = 0.0
    pitch_rad: float = 0.0
    roll_rad: float = 0.0
    sway: list[Callable[[np.ndarray, np.ndarray], np.ndarray]] = field(default_factory=list)  # t, xyz (m) -> xyz
    lens: list[Callable[[np.ndarray], np.ndarray]] = field(default_factory=list)  # points -> points
    shake: list[Callable[[np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]]] = field(default_factory=list)
    # t -> dx (px), dy (px), roll (rad) of the picture about its middle

    edge_sigma_px: float = 0.5  # of the lens's point spread; pixels add their own
    blur_backdrop_px: float = 0.0
    wall_rgb: Colour = (200.0, 200.0, 200.0)
    bob_rgb: Colour = (45.0, 45.0, 50.0)
    string_rgb: Colour = (70.0, 70.0, 70.0)
    string_width_px: float = 2.0
    look: Callable[[np.ndarray, np.ndarray, float, float], np.ndarray] | None = None
    # u, v (unit disc, image axes), θ, t -> colours (…, 3); None: bob_rgb all over
    backdrop: list[Callable[[np.ndarray], None]] = field(default_factory=list)  # paint on the wall (h, w, 3), in place
    behind: list[Callable[[View], list[Patch]]] = field(default_factory=list)  # moving things behind the pendulum
    front: list[Callable[[View], list[Patch]]] = field(default_factory=list)  # and before it

    falloff: list[Callable[[np.ndarray, np.ndarray], np.ndarray]] = field(default_factory=list)  # x, y -> gain
    gain: list[Callable[[np.ndarray, float], np.ndarray]] = field(default_factory=list)  # row times, exposure -> gain
    gamma: float = 1.0
    read_sigma: float = 0.0
    shot_sigma_at_white: float = 0.0
    codec: dict[str, Any] = field(default_factory=dict)

    @property
    def middle_px(self) -> np.ndarray:
        """(2,) the middle of the picture."""
        return np.array([(self.width_px - 1) / 2, (self.height_px - 1) / 2])

    def row_delay_s(self, y_px: np.ndarray | float) -> np.ndarray:
        """How much later than the middle row a row is exposed, in s."""
        return (np.asarray(y_px) - (self.height_px - 1) / 2) * (self.readout_s / self.height_px)
