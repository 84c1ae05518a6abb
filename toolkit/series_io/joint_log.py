"""A motor controller's log: `time,position,velocity,torque`, SI, radians as controllers have them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from toolkit.sentence import said
from toolkit.series import ThetaSeries
from toolkit.series_io.columns import clean_series
from toolkit.series_io.series_format import Look, SeriesFormat
from toolkit.series_io.table_text import parse_table, read_text

_NAMES = ("time", "position", "velocity", "torque")


def _recognises(look: Look) -> bool:
    return bool(look.lines) and tuple(w.strip().lower() for w in look.lines[0].split(",")[:4]) == _NAMES


def read(path: Path) -> ThetaSeries:
    """θ from the joint's position in rad; the motor's torque is kept in `meta` (median and largest, N·m)."""
    table = parse_table(read_text(path), path)
    t_s, theta, _, torque = table.columns.T[:4]
    table.log.append(said("series.joint_log", "Columns time and position of a motor controller's log: s and rad."))
    finite = torque[np.isfinite(torque)]
    largest = float(np.max(np.abs(finite))) if finite.size else 0.0
    if largest > 0:
        driven = "A motor drove this pendulum (torque up to {torque_n_m:.3g} N m): it does not swing freely."
        table.warnings.append(said("series.motor", driven, torque_n_m=largest))
    meta = {"format": "joint log", "largest_motor_torque_n_m": largest}
    return clean_series(t_s, theta, None, path=path, log=table.log, warnings=table.warnings, meta=meta)


FORMAT = SeriesFormat(
    "joint_log", (), "a motor controller's time,position,velocity,torque", _recognises, read, order=20
)
