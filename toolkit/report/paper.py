"""How figures and tables fill a line of paper, for the writers that print."""

from __future__ import annotations

import re

from toolkit.report.document import Figure, Table
from toolkit.report.numbers import bare

_LINE_MM, _TALLEST_MM = 174, 105
_SMALL = {"portrait": 50, "frame": 78}


def width_percent(figure: Figure) -> float:
    """Share of the line's width: no picture takes more than half a page."""
    box = re.search(r'viewBox="[-\d.]+ [-\d.]+ ([\d.]+) ([\d.]+)"', figure.svg)
    tallest = 100.0
    if box:
        tallest = 100 * _TALLEST_MM / _LINE_MM * float(box[1]) / float(box[2])
    return round(min(_SMALL.get(figure.key, 100), tallest), 1)


def column_kinds(table: Table) -> list[str]:
    """`auto` for short columns, `wide` for those whose cells are long; at least one takes the rest of the line."""
    longest = [max(len(bare(row[k])) for row in (table.header, *table.rows)) for k in range(len(table.header))]
    kinds = ["auto" if width <= 28 else "wide" for width in longest]
    if "wide" not in kinds:
        kinds[longest.index(max(longest))] = "wide"
    return kinds
