"""Our own theta.csv: `t_s,theta_rad[,sigma_theta_rad]`, numbers to the last bit; what all frames share is in the
calibration.json that `pendulab track` writes beside it."""

from __future__ import annotations

import json
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from toolkit.sentence import said
from toolkit.series import ThetaSeries
from toolkit.series_io.columns import clean_series
from toolkit.series_io.series_format import Look, SeriesFormat
from toolkit.series_io.table_text import parse_table, read_text

_NAMES = ("t_s", "theta_rad", "sigma_theta_rad")
_FILE, _CALIBRATION = "theta.csv", "calibration.json"
_SHARED = (
    "angle_scale_relative_u",
    "angle_scale_relative_u_of_view",
    "vertical_sigma_rad",
    "sigma_common_share",
    "row_time_u_s",
    "row_direction_rad",
)


def _recognises(look: Look) -> bool:
    return bool(look.lines) and look.lines[0].replace(" ", "").split(",") in (list(_NAMES[:2]), list(_NAMES))


def read(path: Path) -> ThetaSeries:
    """The series in our theta.csv, with what its calibration.json says that all frames share. Raises JobError where it is none."""
    from toolkit.errors import JobError

    table = parse_table(read_text(path), path)
    if table.names is None or table.names[:2] != _NAMES[:2]:
        raise JobError(f"{path} does not begin with t_s,theta_rad; read other formats with read_series")
    columns = dict(zip(table.names, table.columns.T))
    series = clean_series(
        columns["t_s"],
        columns["theta_rad"],
        columns.get("sigma_theta_rad"),
        path=path,
        log=table.log,
        warnings=table.warnings,
        shift=False,
    )
    calibration = _calibration(path)
    shared = {name: calibration[name] for name in _SHARED if isinstance(calibration.get(name), float)}
    if not shared:
        return series
    told = said(
        "series.calibration",
        "What all angles and all times share of their uncertainty is from {file} beside it.",
        file=_CALIBRATION,
    )
    return replace(series, meta={**series.meta, **shared, "calibration": calibration}).logged(told)


def _calibration(path: Path) -> dict[str, Any]:
    """The content of the calibration.json that was written with this theta.csv; empty where there is none."""
    if path.name == _FILE:
        with suppress(OSError, ValueError, RecursionError):
            content = json.loads((path.parent / _CALIBRATION).read_text(encoding="utf-8"))
            return content if isinstance(content, dict) else {}
    return {}


def write(series: ThetaSeries, path: Path) -> None:
    """Write theta.csv; the third column is left out where no σ is known."""
    columns = [series.t_s.tolist(), series.theta_rad.tolist()]
    if series.sigma_theta_rad is not None:
        columns.append(series.sigma_theta_rad.tolist())
    rows = [",".join(map(repr, row)) for row in zip(*columns)]
    path.write_text("\n".join([",".join(_NAMES[: len(columns)]), *rows, ""]), encoding="utf-8", newline="\n")


FORMAT = SeriesFormat(
    "theta_csv", (".csv",), "pendulab's own t_s,theta_rad[,sigma_theta_rad]", _recognises, read, write, order=10
)
