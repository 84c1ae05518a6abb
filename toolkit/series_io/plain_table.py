"""Any text table with a time and an angle column: CSV, TSV or spaces; units from the header or by magnitude."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from toolkit.series import ThetaSeries
from toolkit.series_io.columns import series_from_table
from toolkit.series_io.series_format import Look, SeriesFormat
from toolkit.series_io.table_text import parse_table, read_text


def _recognises(look: Look) -> bool:
    return bool(look.lines)


def read(path: Path) -> ThetaSeries:
    """The series in a text table. Raises JobError where no time or angle column can be told."""
    return series_from_table(parse_table(read_text(path), path), path, "plain table")


def write(series: ThetaSeries, path: Path) -> None:
    """Tab-separated `t (s)`, `θ (degrees)` and its uncertainty, 12 digits: what spreadsheets and fit programs take."""
    columns = [series.t_s, np.degrees(series.theta_rad)]
    names = ["t (s)", "θ (degrees)"]
    if series.sigma_theta_rad is not None:
        columns.append(np.degrees(series.sigma_theta_rad))
        names.append("uncertainty θ (degrees)")
    rows = ["\t".join(f"{value:.12g}" for value in row) for row in zip(*columns)]
    path.write_text("\n".join(["\t".join(names), *rows, ""]), encoding="utf-8", newline="\n")


FORMAT = SeriesFormat(
    "plain_table",
    (".tsv",),
    "any CSV, TSV or spaced table with a time and an angle column",
    _recognises,
    read,
    write,
    order=90,
)
