"""Figures as files: SVG, PDF, and the numbers that each shows as CSV."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Sequence
from importlib.resources import as_file, files
from pathlib import Path

import numpy as np

from toolkit.report.document import Figure, Report


def write_figures(report: Report, folder: Path, formats: Sequence[str]) -> None:
    """Write figures/KEY.svg, .pdf as asked, and KEY.csv, for every figure of the report."""
    target = folder / "figures"
    target.mkdir(parents=True, exist_ok=True)
    for figure in report.figures:
        if "svg" in formats:
            (target / f"{figure.key}.svg").write_text(figure.svg, encoding="utf-8", newline="\n")
        if "pdf" in formats:
            (target / f"{figure.key}.pdf").write_bytes(_pdf(figure))
        (target / f"{figure.key}.csv").write_text(csv_of(figure), encoding="utf-8", newline="\n")


def csv_of(figure: Figure) -> str:
    """The figure's numbers; shorter columns end in empty cells."""
    columns = [np.asarray(column).tolist() for column in figure.data.values()]
    longest = max((len(column) for column in columns), default=0)
    rows = [",".join(_cell(column[i]) if i < len(column) else "" for column in columns) for i in range(longest)]
    return "\n".join([",".join(figure.data), *rows, ""])


def _cell(value: object) -> str:
    return repr(value) if isinstance(value, float) else str(value)


def _pdf(figure: Figure) -> bytes:
    """The SVG as a PDF page of its own size."""
    import typst

    with tempfile.TemporaryDirectory() as scratch, as_file(files("toolkit.report") / "fonts") as fonts:
        root = Path(scratch)
        (root / "figure.svg").write_text(figure.svg, encoding="utf-8")
        name = json.dumps("figure.svg")
        (root / "figure.typ").write_text(
            f"#set document(date: none)\n#set page(width: auto, height: auto, margin: 0pt)\n#image({name})\n",
            encoding="utf-8",
        )
        pdf = typst.compile(str(root / "figure.typ"), font_paths=[str(fonts)], ignore_system_fonts=True)
    assert isinstance(pdf, bytes)
    return pdf
