"""A table of numbers out of a text file: delimiter, decimal mark, header and missing cells found from the text."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from toolkit.errors import JobError
from toolkit.sentence import said
from toolkit.series_io.series_format import decode, peek

_NUMBER = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)([eEdD][+-]?\d+)?\Z")
_MISSING = {"", "-", "--", "nan", "na", "n/a", "null", "none", "inf", "-inf", "+inf", "∞"}
_DELIMITERS = {"\t": "tab", ";": "semicolon", ",": "comma", " ": "space"}


@dataclass(frozen=True)
class Table:
    """`names` of the columns (None without a header), `columns` (rows, columns) with NaN for a missing cell.

    `preamble` are the lines before the header, `log` and `warnings` what reading it took.
    """

    names: tuple[str, ...] | None
    columns: np.ndarray
    preamble: tuple[str, ...] = ()
    log: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)


def read_text(path: Path) -> str:
    """The whole file as text. Raises JobError for what `peek` refuses and for binary data."""
    peek(path)
    text = decode(path.read_bytes())
    if text is None:
        raise JobError(f"{path} is not a text file; export θ(t) as CSV or text")
    return text


def parse_table(text: str, path: Path) -> Table:
    """The table in `text`. Raises JobError naming the line where it is not a table of numbers."""
    numbered = [(n, line.rstrip("\r\n")) for n, line in enumerate(text.splitlines(), 1) if line.strip()]
    comments = [line.lstrip("#% ").rstrip() for _, line in numbered if line.lstrip()[0] in "#%"]
    lines = [(n, line) for n, line in numbered if line.lstrip()[0] not in "#%"]
    delimiter = _delimiter([line for _, line in lines[:60]])
    if delimiter is None:
        raise JobError(
            f"{path} holds no table of numbers with two columns; export θ(t) as CSV with columns t_s,theta_rad"
        )
    rows = [(n, _split(line, delimiter)) for n, line in lines]
    comma = delimiter != ","
    first = next((k for k, (_, cells) in enumerate(rows) if _is_data(cells, comma)), None)
    if first is None:
        raise JobError(f"{path} has column names but no rows of numbers; export θ(t) again")
    width = _width([cells for _, cells in rows[first : first + 60]])
    names = _header([cells for _, cells in rows[max(0, first - 2) : first]], comments, width, delimiter, path)
    data = rows[first:]
    between = said(f"delimiter.{_DELIMITERS[delimiter]}", _DELIMITERS[delimiter])
    rows_read = "Read {count} rows from {file} ({delimiter} between columns)."
    log: list[str] = [said("series.rows", rows_read, count=len(data), file=path.name, delimiter=between)]
    columns, odd, commas = _numbers(data, width, comma, path)
    warnings: list[str] = []
    if commas:
        log.append(said("series.decimal_comma", "Numbers have a decimal comma."))
    if odd:
        words = "{count} cells hold words instead of numbers and count as missing."
        warnings.append(said("series.words_for_numbers", words, count=odd))
    if not np.isfinite(columns).any():
        raise JobError(f"{path} holds no numbers under its column names; export θ(t) again")
    return Table(names, columns, tuple(line for _, line in lines[: max(0, first - 1)]), log, warnings)


def _delimiter(lines: list[str]) -> str | None:
    """The delimiter under which most cells are numbers, in at least two columns."""
    best, best_score = None, 0.0
    for delimiter in _DELIMITERS:
        rows = [_split(line, delimiter) for line in lines]
        rows = [cells for cells in rows if len(cells) > 1]
        cells = [cell for row in rows for cell in row]
        if not cells:
            continue
        score = sum(_is_number(c, delimiter != ",") for c in cells) / len(cells) * len(rows) / len(lines)
        if score > best_score + 1e-9:
            best, best_score = delimiter, score
    return best


def _split(line: str, delimiter: str) -> list[str]:
    if delimiter == " ":
        cells = line.split()
    elif '"' in line:
        cells = next(csv.reader([line], delimiter=delimiter))
    else:
        cells = line.split(delimiter)
    cells = [cell.strip() for cell in cells]
    while len(cells) > 1 and cells[-1] == "":  # a trailing delimiter
        cells.pop()
    return cells


def _is_number(cell: str, comma: bool) -> bool:
    return bool(_NUMBER.match(cell)) and (comma or "," not in cell)


def _is_data(cells: list[str], comma: bool) -> bool:
    numbers = sum(_is_number(c, comma) for c in cells)
    return numbers >= 1 and numbers + sum(c.lower() in _MISSING for c in cells) == len(cells)


def _width(rows: list[list[str]]) -> int:
    widths = [len(cells) for cells in rows]
    return max(set(widths), key=lambda w: (widths.count(w), w))


def _header(
    above: list[list[str]], comments: list[str], width: int, delimiter: str, path: Path
) -> tuple[str, ...] | None:
    candidates = above or [_split(line, delimiter) for line in comments[-1:]]
    if not candidates:
        return None
    last = candidates[-1]
    if delimiter == " " and len(last) > width:
        last = _joined_units(last)
    if not above and (len(last) != width or all(_is_number(c, True) for c in last)):
        return None
    two_lines = len(above) == 2 and len(above[0]) == len(last) and not any(_is_number(c, True) for c in above[0])
    if two_lines and all(len(c) <= 12 for c in last):  # names, and their units below
        return tuple(f"{name} ({unit.strip('()[]')})" if unit else name for name, unit in zip(above[0], last))
    if len(last) > width:
        raise JobError(f"{path}: {len(last)} column names stand over rows of {width} cells; check the delimiter")
    if len(last) < width:
        what = "decimal commas in a file whose delimiter is a comma?" if delimiter == "," else "check the delimiter"
        raise JobError(
            f"{path}: rows of {width} cells stand under {len(last)} column names; {what} Save it with points or tabs"
        )
    return tuple(last)


def _joined_units(cells: list[str]) -> list[str]:
    """`θ (rad)` in a file delimited by spaces is one name."""
    names: list[str] = []
    depth = 0
    for cell in cells:
        if names and (depth or cell[0] in "(["):
            names[-1] += " " + cell
        else:
            names.append(cell)
        depth = max(0, depth + sum(c in "([" for c in cell) - sum(c in ")]" for c in cell))
    return names


def _numbers(data: list[tuple[int, list[str]]], width: int, comma: bool, path: Path) -> tuple[np.ndarray, int, bool]:
    for number, cells in data:
        if len(cells) > width:
            what = f"line {number} has {len(cells)} cells where {width} are expected"
            raise JobError(f"{path}: {what}; check the delimiter and the decimal mark there")
    try:
        return np.array([cells for _, cells in data], dtype=float), 0, False
    except ValueError:
        pass
    columns = np.full((len(data), width), np.nan)
    odd, commas = 0, False
    for i, (_, cells) in enumerate(data):
        for j, cell in enumerate(cells):
            if _is_number(cell, comma):
                commas |= "," in cell
                columns[i, j] = float(cell.replace(",", ".").lower().replace("d", "e"))
            elif cell.lower() not in _MISSING:
                odd += 1
    return columns, odd, commas
