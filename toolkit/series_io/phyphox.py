"""phyphox exports: a CSV, or the zip it comes in. The gyroscope's rate is integrated; an angle is taken as it is."""

from __future__ import annotations

import re
import zipfile
from datetime import date
from pathlib import Path

import numpy as np

from toolkit.errors import JobError
from toolkit.sentence import said
from toolkit.series import ThetaSeries
from toolkit.series_io.columns import clean_series
from toolkit.series_io.series_format import Look, SeriesFormat, decode, peek
from toolkit.series_io.table_text import Table, parse_table, read_text
from toolkit.series_io.tracker_trk import member_of_zip

_MAX_CSV_BYTES = 200_000_000
_TIME = re.compile(r"(time|t)\s*\(s\)\Z", re.IGNORECASE)
_DAY = re.compile(r'"(\d{4}-\d\d-\d\d) \d\d:\d\d')
_RATE = re.compile(r"(gyroscope|angular velocity|rotation rate)\b.*\(rad/s\)\Z", re.IGNORECASE)
_ANGLE = re.compile(r"(angle|tilt|inclination|pitch|roll)\b.*\((deg|°|rad)\)\Z", re.IGNORECASE)


def _recognises(look: Look) -> bool:
    if look.head[:4] == b"PK\x03\x04":
        return True
    names = re.split(r'[\t;,](?=")|[\t;,]', look.lines[0]) if look.lines else []
    names = [name.strip().strip('"') for name in names]
    return bool(names) and bool(_TIME.match(names[0])) and any(_RATE.match(n) for n in names)


def read(path: Path) -> ThetaSeries:
    """θ from the angle column, else from the integrated rate of the axis that turns most. Raises JobError."""
    peek(path)
    started = None
    if zipfile.is_zipfile(path):
        text = decode(member_of_zip(path, (".csv",), _MAX_CSV_BYTES, prefer="raw"))
        started = _started(path)
        if text is None:
            raise JobError(f"{path}: the CSV in the archive is not text; export from phyphox again")
    elif path.read_bytes()[:2] == b"PK":
        raise JobError(f"{path} is a damaged archive; export from phyphox again")
    else:
        text = read_text(path)
    table = parse_table(text, path)
    names = table.names or ()
    times = [k for k, name in enumerate(names) if _TIME.match(name)]
    angles = [k for k, name in enumerate(names) if _ANGLE.match(name)]
    rates = [k for k, name in enumerate(names) if _RATE.match(name) and "abs" not in name.lower()]
    if not times or not (angles or rates):
        shown = ", ".join(repr(n) for n in names[:6]) or "none"
        raise JobError(
            f"{path} is no phyphox record of an angle or a gyroscope (columns: {shown}); export the gyroscope's raw data"
        )
    t = table.columns[:, times[0]]
    k = max(angles or rates, key=lambda j: float(np.nanstd(table.columns[:, j])))
    table.log.append(said("series.phyphox", "phyphox column used: {name!r}.", name=names[k]))
    sigma = None
    if angles:
        scale = 1.0 if "(rad)" in names[k].lower() else np.pi / 180
        theta = table.columns[:, k] * scale
        sigma = _sigma_column(table, names, scale)
    else:
        t, theta = _integrated(t, table.columns[:, k], path, table.log)
        others = [float(np.nanstd(table.columns[:, j])) for j in rates if j != k]
        if others and max(others) > 0.3 * float(np.nanstd(table.columns[:, k])):
            turned = "The phone turned about more than one of its axes; hang it so that one axis lies across the swing."
            table.warnings.append(said("series.several_axes", turned))
    meta: dict[str, object] = {"format": "phyphox"}
    if started is not None:
        meta["recorded_on"] = started
    return clean_series(t, theta, sigma, path=path, log=table.log, warnings=table.warnings, meta=meta)


def _started(path: Path) -> date | None:
    """The day of the recording out of meta/time.csv, in the phone's own time zone; None where the archive has none."""
    with zipfile.ZipFile(path) as archive:
        if "meta/time.csv" not in archive.namelist():
            return None
        with archive.open("meta/time.csv") as member:
            found = _DAY.search(member.read(100_000).decode("utf-8", errors="replace"))
    try:
        return date.fromisoformat(found[1]) if found else None
    except ValueError:
        return None


def _sigma_column(table: Table, names: tuple[str, ...], scale: float) -> np.ndarray | None:
    found = [k for k, name in enumerate(names) if name.lower().startswith("uncertainty")]
    return table.columns[:, found[0]] * scale if found else None


def _integrated(t: np.ndarray, rate: np.ndarray, path: Path, log: list[str]) -> tuple[np.ndarray, np.ndarray]:
    """θ from θ̇ by the trapezoid rule; the gyroscope's offset and the unknown start angle are taken out.

    Over whole swings of a free pendulum both θ and θ̇ average to zero: the straight line through the running
    middle of θ is what the offset and the start angle leave.
    """
    good = np.isfinite(t) & np.isfinite(rate)
    t, rate = t[good], rate[good]
    if t.size < 8:
        raise JobError(f"{path} holds {t.size} readings of the gyroscope; record at least one swing")
    rate = rate - rate.mean()
    theta = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(t))])
    turns = np.flatnonzero(np.diff(np.sign(rate)) != 0)
    if turns.size < 3:
        raise JobError(f"{path} holds fewer than two swings; record the pendulum for longer")
    tops = theta[turns]
    middle_t = 0.25 * (t[turns[:-2]] + 2 * t[turns[1:-1]] + t[turns[2:]])
    middle = 0.25 * (tops[:-2] + 2 * tops[1:-1] + tops[2:])
    line = np.polyfit(middle_t, middle, 1 if middle.size > 3 else 0)
    log.append(
        said(
            "series.integrated",
            "θ is the gyroscope's rate integrated over time; its offset and the start angle were taken out (the swing is "
            "symmetric).",
        )
    )
    return t, theta - np.polyval(line, t)


def write(series: ThetaSeries, path: Path) -> None:
    """A zip as phyphox has it, with `Raw Data.csv` of Time (s) and Angle (rad), numbers to the last bit."""
    names = ['"Time (s)"', '"Angle (rad)"']
    columns = [series.t_s.tolist(), series.theta_rad.tolist()]
    if series.sigma_theta_rad is not None:
        names.append('"Uncertainty of angle (rad)"')
        columns.append(series.sigma_theta_rad.tolist())
    text = "\n".join([",".join(names), *(",".join(map(repr, row)) for row in zip(*columns)), ""])
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        entry = zipfile.ZipInfo("Raw Data.csv", date_time=(1980, 1, 1, 0, 0, 0))
        entry.compress_type = zipfile.ZIP_DEFLATED
        archive.writestr(entry, text)


FORMAT = SeriesFormat(
    "phyphox",
    (".zip",),
    "phyphox CSV or zip: an angle, or a gyroscope's rate integrated",
    _recognises,
    read,
    write,
    order=12,
)
