"""Our own theta.csv: `t_s,theta_rad[,sigma_theta_rad]`, numbers to the last bit."""

from __future__ import annotations

from pathlib import Path

from toolkit.series import ThetaSeries
from toolkit.series_io.columns import clean_series
from toolkit.series_io.series_format import Look, SeriesFormat
from toolkit.series_io.table_text import parse_table, read_text

_NAMES = ("t_s", "theta_rad", "sigma_theta_rad")


def _recognises(look: Look) -> bool:
    return bool(look.lines) and look.lines[0].replace(" ", "").split(",") in (list(_NAMES[:2]), list(_NAMES))


def read(path: Path) -> ThetaSeries:
    """The series in our theta.csv. Raises JobError where it is not one."""
    from toolkit.errors import JobError

    table = parse_table(read_text(path), path)
    if table.names is None or table.names[:2] != _NAMES[:2]:
        raise JobError(f"{path} does not begin with t_s,theta_rad; read other formats with read_series")
    columns = dict(zip(table.names, table.columns.T))
    return clean_series(
        columns["t_s"],
        columns["theta_rad"],
        columns.get("sigma_theta_rad"),
        path=path,
        log=table.log,
        warnings=table.warnings,
        shift=False,
    )


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
