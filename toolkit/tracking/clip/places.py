"""Where the bob was on every frame of a clip, as columns."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from toolkit.tracking.follow import Record


@dataclass(frozen=True)
class Places:
    """Where the bob was, one entry a decoded frame: (n,) arrays, in the pixels of a still camera.

    t_s : when, the first frame used at 0.    x_px, y_px, sigma_x_px, sigma_y_px : the places, and the localiser's own σ of
    them.    good : bool, on which frames they are believed.    repeated : bool, pictures that are those before them again.
    kind : int, of picture, as the codec coded it (`Frame`).    misfit : what the localiser left unexplained of the picture (rms,
    grey levels). Both None where that is not known.
    """

    t_s: np.ndarray
    x_px: np.ndarray
    y_px: np.ndarray
    sigma_x_px: np.ndarray
    sigma_y_px: np.ndarray
    good: np.ndarray
    repeated: np.ndarray
    kind: np.ndarray | None = None
    misfit: np.ndarray | None = None

    @classmethod
    def of(cls, record: Record, t_s: np.ndarray) -> Places:
        """Those of a record, at times t_s (n,)."""
        x, y, sx, sy, misfit = np.array([p[:5] for p in record.place], float).T
        return cls(t_s, x, y, sx, sy, np.array(record.ok), np.array(record.repeated), np.array(record.kind), misfit)

    def without(self, frames: np.ndarray) -> Places:
        """The same with these frames (n,) bool not believed, and no place or σ where none is."""
        good = self.good & ~frames
        names = ("x_px", "y_px", "sigma_x_px", "sigma_y_px")
        return replace(self, good=good, **{name: np.where(good, getattr(self, name), np.nan) for name in names})

    @property
    def extent_px(self) -> float:
        """How far across the picture the bob swings."""
        return float(np.hypot(np.ptp(self.x_px[self.good]), np.ptp(self.y_px[self.good])))

    def some(self, most: int = 1500) -> np.ndarray:
        """Indices of up to twice `most` good frames, evenly spread: enough for a fit."""
        chosen = np.flatnonzero(self.good)
        return chosen[:: max(1, chosen.size // most)]
