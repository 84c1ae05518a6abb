"""Pixel positions of the bob on each frame: a time column with x and y; θ about the centre of the arc."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from toolkit.errors import JobError
from toolkit.sentence import said
from toolkit.series import ThetaSeries
from toolkit.series_io.arc import swing_from_positions
from toolkit.series_io.columns import clean_series, understand
from toolkit.series_io.series_format import Look, SeriesFormat
from toolkit.series_io.table_text import Table, parse_table, read_text


def _recognises(look: Look) -> bool:
    if not look.lines:
        return False
    for delimiter in ",;\t":
        kinds = [understand(name) for name in look.lines[0].split(delimiter)]
        plain = {c.quantity for c in kinds if not c.sigma}
        if {"t", "x", "y"} <= plain:
            return "theta" not in plain
    return False


def read(path: Path) -> ThetaSeries:
    """θ from x, y in pixels (y down) or in any unit with y up where the bob then hangs below its arc's centre."""
    table = parse_table(read_text(path), path)
    assert table.names is not None
    return series_from_positions(table, path)


def series_from_positions(table: Table, path: Path) -> ThetaSeries:
    """The series of a table that has columns of time, x and y. Raises JobError where the points lie on no arc."""
    assert table.names is not None
    columns = [understand(name) for name in table.names]
    at = {c.quantity: k for k, c in reversed(list(enumerate(columns))) if not c.sigma}
    scale = columns[at["t"]].scale or 1.0
    t_s, x, y = (table.columns[:, at[q]] for q in ("t", "x", "y"))
    try:  # the middle of a swing lies lowest: below its ends in the picture
        good = np.isfinite(x) & np.isfinite(y)
        y_down = _bends_down(x[good], y[good])
        swing = swing_from_positions(x, -y if y_down else y)
    except JobError as error:
        raise JobError(f"{path}: {error}") from error
    names = ", ".join(repr(table.names[at[q]]) for q in ("t", "x", "y"))
    direction = said("series.y_down", "down") if y_down else said("series.y_up", "up")
    table.log.append(
        said("series.positions", "Columns used: {names}; y points {direction}.", names=names, direction=direction)
    )
    table.log.extend(swing.log)
    table.warnings.extend(swing.warnings)
    meta = {
        "format": "pixel positions",
        "calibration": {"pivot_px": [swing.x, -swing.y if y_down else swing.y], "arc_radius_px": swing.length},
        "angle_scale_relative_u": swing.length_sigma / swing.length,
    }
    sigma = np.full(t_s.shape, max(swing.scatter, 1 / np.sqrt(12) if _whole(x) else 0.0) / swing.length)
    by_scatter = "σ of the angle is the scatter of the positions about the arc, divided by its radius."
    table.log.append(said("series.sigma_by_arc", by_scatter))
    return clean_series(
        t_s * scale, swing.theta_rad, sigma, path=path, log=table.log, warnings=table.warnings, meta=meta
    )


def _bends_down(x: np.ndarray, y: np.ndarray) -> bool:
    """Whether y points down: the arc's middle then has the larger y."""
    if x.size < 4 or np.ptp(x) == 0:
        raise JobError("the positions do not move sideways; check which columns are x and y")
    u = (x - x.mean()) / np.ptp(x)
    return bool(np.polyfit(u, y, 2)[0] < 0)


def _whole(x: np.ndarray) -> bool:
    good = x[np.isfinite(x)]
    return bool(np.all(good == np.round(good)))


FORMAT = SeriesFormat(
    "pixel_positions",
    (),
    "a time column with the bob's x and y; the pivot is the arc's centre",
    _recognises,
    read,
    order=40,
)
