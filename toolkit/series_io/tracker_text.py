"""Tracker's text export: a row of track names, a row of column names, numbers as 0.000000E0, degrees by default."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from toolkit.errors import JobError
from toolkit.sentence import said
from toolkit.series import ThetaSeries
from toolkit.series_io.arc import swing_from_positions
from toolkit.series_io.columns import angle_scale_by_size, clean_series
from toolkit.series_io.series_format import Look, SeriesFormat
from toolkit.series_io.table_text import read_text

_COLUMNS = frozenset(
    [
        "t",
        "x",
        "y",
        "r",
        "θr",
        "θ_{r}",
        "thetar",
        "vx",
        "vy",
        "v",
        "θv",
        "ax",
        "ay",
        "a",
        "θa",
        "θ",
        "theta",
        "ω",
        "α",
        "step",
        "frame",
        "px",
        "py",
        "p",
        "θp",
        "pixelx",
        "pixely",
        "L",
        "K",
        "m",
    ]
)
_DELIMITERS = "\t;, "


def _recognises(look: Look) -> bool:
    return _layout(look.lines[:4]) is not None


def _layout(lines: list[str]) -> tuple[int, str] | None:
    """(index of the row of column names, delimiter), or None where this is no Tracker export."""
    start = 1 if lines and lines[0].strip().lower().startswith("#multi") else 0
    if len(lines) < start + 2:
        return None
    for delimiter in _DELIMITERS:
        names = _cells(lines[start + 1], delimiter)
        above = _cells(lines[start], delimiter)
        known = sum(name in _COLUMNS for name in names)
        titles = any(cell and not _number(cell) and cell not in _COLUMNS for cell in above)
        marked = start == 1 or lines[start].startswith(delimiter) or lines[start + 1].rstrip("\r\n").endswith(delimiter)
        if "t" in names and known >= max(2, 0.6 * len(names)) and titles and marked:
            return start + 1, delimiter
    return None


def _cells(line: str, delimiter: str) -> list[str]:
    cells = [c.strip() for c in line.rstrip("\r\n").split(delimiter)]
    return cells[:-1] if len(cells) > 1 and cells[-1] == "" else cells


def _number(cell: str) -> bool:
    return bool(cell) and cell[0] in "+-.0123456789"


def read(path: Path) -> ThetaSeries:
    """θ of the track that moves most, from its θ column or from its positions. Raises JobError, one line."""
    lines = [line for line in read_text(path).splitlines() if line.strip()]
    layout = _layout(lines[:4])
    if layout is None:
        raise JobError(f"{path} is not a text export of Tracker; export with column names")
    row, delimiter = layout
    names = _cells(lines[row], delimiter)
    owners = _owners(_cells(lines[row - 1], delimiter), len(names))
    columns = _columns(lines[row + 1 :], delimiter, len(names), path)
    rows_read = "Read {count} rows of a Tracker text export, {file}."
    log: list[str] = [said("series.tracker_text", rows_read, count=columns.shape[0], file=path.name)]
    warnings: list[str] = []
    time = columns[:, names.index("t")]
    track = _moving_track(names, owners, columns, warnings, path)
    mine = {name: columns[:, k] for k, name in enumerate(names) if owners[k] == track or name == "t"}
    if track:
        log.append(said("series.track_used", "Track {name!r} was used.", name=track))
    meta: dict[str, object] = {"format": "Tracker text export"}
    theta = _theta(mine, path, log, warnings, meta)
    return clean_series(time, theta, None, path=path, log=log, warnings=warnings, meta=meta)


def _owners(titles: list[str], width: int) -> list[str]:
    """Each column's track: a title stands over its track's first column."""
    owners, current = [], ""
    for k in range(width):
        if k < len(titles) and titles[k]:
            current = titles[k]
        owners.append(current)
    if width and not owners[0]:
        first = next((o for o in owners if o), "")
        owners = [o or first for o in owners]
    return owners


def _columns(lines: list[str], delimiter: str, width: int, path: Path) -> np.ndarray:
    values = np.full((len(lines), width), np.nan)
    for i, line in enumerate(lines):
        cells = _cells(line, delimiter)
        if len(cells) > width + 1 or (len(cells) == width + 1 and cells[-1]):
            hint = "decimal commas need another delimiter" if delimiter == "," else "the line may be damaged"
            raise JobError(f"{path}: row {i + 1} of the data has {len(cells)} cells under {width} names; {hint}")
        for j, cell in enumerate(cells[:width]):
            if cell:
                try:
                    values[i, j] = float(cell.replace(",", "."))
                except ValueError:
                    raise JobError(
                        f"{path}: row {i + 1} of the data holds {cell[:20]!r} where a number is expected"
                    ) from None
    if not np.isfinite(values).any():
        raise JobError(f"{path} is a Tracker export without numbers; export again with all steps")
    return values


def _moving_track(names: list[str], owners: list[str], columns: np.ndarray, warnings: list[str], path: Path) -> str:
    moves: dict[str, float] = {}
    for k, name in enumerate(names):
        column = columns[:, k][np.isfinite(columns[:, k])]
        if name in ("θ", "theta", "θr", "θ_{r}", "thetar", "x", "pixelx") and column.size >= 2:
            spread = float(np.std(column)) * column.size
            moves[owners[k]] = max(moves.get(owners[k], 0.0), spread)
    if not moves:
        shown = ", ".join(names[:8])
        raise JobError(
            f"{path} holds neither an angle nor positions (columns: {shown}); export t with θ, or with x and y"
        )
    best = max(moves, key=lambda owner: moves[owner])
    if len(moves) > 1:
        several = "The file holds {count} tracks; the one that moves most, {name!r}, was used."
        warnings.append(said("series.tracks", several, count=len(moves), name=best))
    return best


def _theta(
    mine: dict[str, np.ndarray], path: Path, log: list[str], warnings: list[str], meta: dict[str, object]
) -> np.ndarray:
    """Angle from the downward vertical in rad, from the best column there is."""
    for name in ("θ", "theta"):
        if name in mine and np.isfinite(mine[name]).any():
            scale = _scale_by_positions(mine, name) or angle_scale_by_size(mine[name], path, warnings)
            unit = said("series.radians", "radians") if scale == 1 else said("series.degrees", "degrees")
            log.append(
                said("series.tracker_angle", "The angle is Tracker's column {name!r}, in {unit}.", name=name, unit=unit)
            )
            return mine[name] * scale
    if "x" in mine and "y" in mine:
        try:
            swing = swing_from_positions(
                mine["x"], mine["y"], origin=(0.0, 0.0), unit=said("series.lengths", "units of length")
            )
        except JobError as error:
            raise JobError(f"{path}: {error}") from error
        log.extend(swing.log)
        warnings.extend(swing.warnings)
        meta["length_m"] = swing.length
        meta["length_sigma_m"] = swing.length_sigma
        metres = "Tracker's text export names no unit of length; metres were assumed for the pendulum's length."
        warnings.append(said("series.metres_assumed", metres))
        return swing.theta_rad
    for name in ("θr", "θ_{r}", "thetar"):
        if name in mine and np.isfinite(mine[name]).any():
            return _from_polar(mine[name] * angle_scale_by_size(mine[name], path, warnings), log)
    raise JobError(f"{path} holds x without y; export t with θ, or with both x and y")


def _scale_by_positions(mine: dict[str, np.ndarray], name: str) -> float | None:
    """The unit of an angle column that stands beside x and y: the one in which both swing as wide; None without them."""
    if "x" not in mine or "y" not in mine:
        return None
    good = np.isfinite(mine[name]) & np.isfinite(mine["x"]) & np.isfinite(mine["y"])
    if np.sum(good) < 4:
        return None
    swing = float(np.std(np.unwrap(np.arctan2(mine["x"][good], -mine["y"][good]))))
    spread = float(np.std(mine[name][good]))
    if not (swing > 0 and spread > 0):
        return None
    for scale in (1.0, np.pi / 180):
        if 0.5 < spread * scale / swing < 2:
            return float(scale)
    return None


def _from_polar(polar_rad: np.ndarray, log: list[str]) -> np.ndarray:
    """From Tracker's position angle (from the +x axis, counter-clockwise) to θ from the axis about which it swings."""
    good = np.isfinite(polar_rad)
    theta = polar_rad.copy()
    theta[good] = np.unwrap(polar_rad[good])
    quarter = round(float(np.median(theta[good])) / (np.pi / 2))
    if quarter:
        about = "Tracker's position angle swings about {angle_deg}°; that direction was taken as the vertical."
        log.append(said("series.polar", about, angle_deg=90 * quarter))
    return theta - quarter * np.pi / 2


def write(series: ThetaSeries, path: Path) -> None:
    """A one-track export as Tracker writes it: t, x, y, θ in degrees, tab-delimited with a trailing tab, 13 digits.

    x and y are in metres about the pivot, with the length from `meta` (1 m where it is not known); they tell a reader
    that θ is in degrees. σ has no place in this format and is not written.
    """
    length = float(series.meta.get("length_m", 1.0))
    x, y = length * np.sin(series.theta_rad), -length * np.cos(series.theta_rad)
    columns = (series.t_s, x, y, np.degrees(series.theta_rad))
    rows = ["".join(f"{value:.12E}\t" for value in row) for row in zip(*columns)]
    path.write_text("\n".join(["\tmass A\t\t\t", "t\tx\ty\tθ\t", *rows, ""]), encoding="utf-8", newline="\n")


FORMAT = SeriesFormat("tracker_text", (".txt",), "Tracker's text export", _recognises, read, write, order=15)
