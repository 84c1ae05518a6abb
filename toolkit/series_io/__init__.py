"""Formats of θ(t) files, one file each. A format is a module of this package with a module-level `FORMAT`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from toolkit.registry import load_part, part_names

if TYPE_CHECKING:
    from toolkit.series import ThetaSeries

_FEWEST = 4
_NOT_PARTS = frozenset({"series_format", "table_text", "columns", "arc"})


def format_names() -> tuple[str, ...]:
    """The names of all formats of θ(t) files."""
    return part_names(_package(), _NOT_PARTS)


def load_format(name: str) -> Any:
    """The `SeriesFormat` of that name. Raises UsageError for an unknown name."""
    return load_part(_package(), name, "FORMAT", _NOT_PARTS)


def read_series(path: str | Path) -> ThetaSeries:
    """θ(t) from a file of any known format; the format is told from the content, not from the name.

    All that was decided on the way (units by magnitude, rows left out, pivot by arc) stands in `meta["log"]` and
    `meta["warnings"]`. Raises JobError, in one line, where the file cannot be used.
    """
    from toolkit.errors import JobError
    from toolkit.series_io.series_format import peek

    look = peek(Path(path))
    formats = sorted((load_format(name) for name in format_names()), key=lambda f: (f.order, f.name))
    for kind in formats:
        if kind.recognises(look):
            series: ThetaSeries = kind.read(Path(path))
            if len(series) < _FEWEST:
                raise JobError(f"{path} holds {len(series)} points of θ(t); at least {_FEWEST} are needed for a swing")
            return series
    raise JobError(f"{path} is not a table of θ(t) that pendulab knows; export it as CSV with columns t_s,theta_rad")


def write_series(series: ThetaSeries, path: str | Path, format: str | None = None) -> None:
    """Write θ(t) in the named format, or in the one that the suffix stands for (.csv .tsv .txt .trk .trz .zip).

    Raises UsageError for an unknown format or suffix or for a format that is only read, JobError where the
    series cannot be said in that format.
    """
    from toolkit.errors import UsageError
    from toolkit.output import whole_file

    path = Path(path)
    if format is not None:
        kind = load_format(format)
        if kind.write is None:
            raise UsageError(f"the format {format!r} is only read; choose one of {', '.join(_writers())}")
    else:
        kinds = [
            k for k in (load_format(name) for name in format_names()) if k.write and path.suffix.lower() in k.suffixes
        ]
        if not kinds:
            suffixes = sorted({s for name in _writers() for s in load_format(name).suffixes})
            raise UsageError(f"{path.name}: no format has the suffix {path.suffix!r}; use one of {' '.join(suffixes)}")
        kind = min(kinds, key=lambda k: k.order)
    with whole_file(path) as scratch:
        kind.write(series, scratch)


def _writers() -> list[str]:
    return [name for name in format_names() if load_format(name).write is not None]


def _package() -> Any:
    import sys

    return sys.modules[__name__]
