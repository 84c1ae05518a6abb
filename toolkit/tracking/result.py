"""Where the bob was: what tracking gives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from toolkit.output import whole_file

OK, PREDICTED, LOST = "ok", "predicted", "lost"


@dataclass(frozen=True)
class Track:
    """Where the bob was. All arrays have one entry a decoded frame.

    frame : (n,) int, decoded frames from 0.    t_s : (n,) true time stamps in s, first frame used at 0.
    x_px, y_px : (n,) bob centre in that frame's own pixels (first pixel's centre is (0, 0), y down); NaN if lost.
    sigma_x_px, sigma_y_px : (n,) standard uncertainties; NaN if lost.
    status : (n,) str, `ok` (measured), `predicted` (hidden: from the motion) or `lost`.
    radius_px : the bob's radius.    pivot_px : (x, y) of the pivot, may lie outside the picture.
    pivot_sigma_px : its standard uncertainties.    localiser : the tracker that measured most frames.
    meta : source, width_px, height_px, fps, time_source, log (sentences), warnings (sentences) and what else
        the stages after may use (string direction on each frame, exposure_s, velocities …).
    """

    frame: np.ndarray
    t_s: np.ndarray
    x_px: np.ndarray
    y_px: np.ndarray
    sigma_x_px: np.ndarray
    sigma_y_px: np.ndarray
    status: np.ndarray
    radius_px: float
    pivot_px: tuple[float, float]
    pivot_sigma_px: tuple[float, float]
    localiser: str
    meta: Mapping[str, Any] = field(default_factory=dict)

    @property
    def ok(self) -> np.ndarray:
        """(n,) bool: the frames on which the bob was measured."""
        return self.status == OK

    def _repr_html_(self) -> str:
        from toolkit.report.notebook import track_html

        return track_html(self)


def write_track_csv(track: Track, path: str | Path) -> None:
    """Write track.csv: frame,t_s,x_px,y_px,sigma_x_px,sigma_y_px,status and where measured the string's direction."""
    with whole_file(path) as scratch, scratch.open("w", encoding="utf-8", newline="\n") as file:
        file.write("frame,t_s,x_px,y_px,sigma_x_px,sigma_y_px,status\n")
        columns = zip(track.frame, track.t_s, track.x_px, track.y_px, track.sigma_x_px, track.sigma_y_px, track.status)
        for frame, t, x, y, sx, sy, status in columns:
            numbers = ",".join(
                "" if not np.isfinite(v) else f"{v:.6g}" if v in (sx, sy) else f"{v:.5f}" for v in (x, y, sx, sy)
            )
            file.write(f"{frame},{t:.9g},{numbers},{status}\n")
