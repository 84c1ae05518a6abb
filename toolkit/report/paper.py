"""How figures and tables fill a line of paper, for the writers that print."""

from __future__ import annotations

import re
from collections.abc import Iterable

from toolkit.report.document import Block, Figure, Table
from toolkit.report.numbers import bare

_LINE_PT = 72 * 6.9  # as wide as the widest drawing
_FRAME_PERCENT, _TALLEST = 60.0, 0.45  # a frame of the video: share of the line, height over the line's length


def width_percent(figure: Figure) -> float:
    """Share of the line's width: drawings keep their size, so that their letters do; a video's frame stays small."""
    drawn = re.search(r'width="([\d.]+)pt"', figure.svg)
    if drawn:
        return round(min(100.0, 100 * float(drawn[1]) / _LINE_PT), 1)
    box = re.search(r'viewBox="[-\d.]+ [-\d.]+ ([\d.]+) ([\d.]+)"', figure.svg)
    return round(min(_FRAME_PERCENT, 100 * _TALLEST * float(box[1]) / float(box[2])), 1) if box else 100.0


def lines(blocks: Iterable[Block]) -> list[list[Block]]:
    """The blocks in order, with figures that are neighbours and fit on one line together."""
    rows: list[list[Block]] = []
    free = 0.0
    for block in blocks:
        width = width_percent(block) if isinstance(block, Figure) and "pt" in block.svg[:400] else 101.0
        if width <= free:
            rows[-1].append(block)
            free -= width
        else:
            rows.append([block])
            free = 100.5 - width
    return rows


def column_kinds(table: Table) -> list[str]:
    """`auto` for short columns, `wide` for those whose cells are long; at least one takes the rest of the line."""
    longest = [max(len(bare(row[k])) for row in (table.header, *table.rows)) for k in range(len(table.header))]
    kinds = ["auto" if width <= 28 else "wide" for width in longest]
    if "wide" not in kinds:
        kinds[longest.index(max(longest))] = "wide"
    return kinds
