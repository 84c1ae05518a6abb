"""Report: one value that every writer reads. Texts carry the marks of `numbers.rich`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from toolkit.report.words import Words


@dataclass(frozen=True)
class Figure:
    """A picture in SVG and the numbers it shows (`data`: column name with unit -> 1-D array)."""

    key: str
    caption: str
    svg: str
    data: Mapping[str, np.ndarray] = field(default_factory=dict)


@dataclass(frozen=True)
class Table:
    """Rows of texts under a header.

    `mark` is the index of the row to stress (the preferred model), if any. `volatile` are columns that differ from run
    to run (times taken); the PDF leaves them out, so that the same input gives the same file.
    """

    key: str
    caption: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    mark: int | None = None
    volatile: tuple[int, ...] = ()

    @property
    def steady(self) -> Table:
        """This table without its volatile columns."""

        def kept(row: tuple[str, ...]) -> tuple[str, ...]:
            return tuple(cell for k, cell in enumerate(row) if k not in self.volatile)

        return replace(self, header=kept(self.header), rows=tuple(map(kept, self.rows)), volatile=())


@dataclass(frozen=True)
class Equation:
    """A displayed formula, in LaTeX and drawn as SVG."""

    latex: str
    svg: str


@dataclass(frozen=True)
class Paragraph:
    """A paragraph; with `items` a list below it."""

    text: str
    items: tuple[str, ...] = ()


Block = Figure | Table | Equation | Paragraph


@dataclass(frozen=True)
class Section:
    """A heading and what stands under it."""

    key: str
    title: str
    blocks: tuple[Block, ...]


@dataclass(frozen=True)
class Fact:
    """One line of the essentials: a question, its answer and a remark."""

    question: str
    answer: str
    remark: str = ""


@dataclass(frozen=True)
class Verdict:
    """An assumption judged: `verdict` is holds | fails | not_distinguishable, the rest are words."""

    assumption: str
    verdict: str
    title: str
    label: str
    sentence: str
    remedy: str
    figure: Figure | None


@dataclass(frozen=True)
class Report:
    """All of a report. `cautions` are what a reader of the first page must know. `sheets` (name -> column -> values) are numbers for a spreadsheet."""

    title: str
    subtitle: str
    lead: str
    facts: tuple[Fact, ...]
    verdicts: tuple[Verdict, ...]
    sections: tuple[Section, ...]
    footer: str
    words: Words
    cautions: tuple[str, ...] = ()
    sheets: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    @property
    def figures(self) -> tuple[Figure, ...]:
        """Every figure, in the order of the report."""
        first = [v.figure for v in self.verdicts if v.figure is not None]
        return tuple(first + [b for s in self.sections for b in s.blocks if isinstance(b, Figure)])
