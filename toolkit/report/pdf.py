"""report.pdf, set by typst: fonts embedded, no system font, the same bytes for the same report."""

from __future__ import annotations

import json
import re
import tempfile
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any

from toolkit.report.document import Block, Equation, Figure, Report, Table
from toolkit.report.html import numbering
from toolkit.report.numbers import bare, rich
from toolkit.report.paper import column_kinds, lines, width_percent


def write(report: Report, folder: Path) -> Path:
    """Write report.pdf; returns its path."""
    path = folder / "report.pdf"
    path.write_bytes(render(report))
    return path


def render(report: Report) -> bytes:
    """The PDF as bytes."""
    import typst

    with tempfile.TemporaryDirectory() as scratch, as_file(files("toolkit.report") / "fonts") as fonts:
        root = Path(scratch)
        template = (files("toolkit.report") / "templates" / "report.typ").read_text(encoding="utf-8")
        (root / "report.typ").write_text(template, encoding="utf-8")
        content = json.dumps(_content(report, root), ensure_ascii=False)
        (root / "report.json").write_text(content, encoding="utf-8")
        pdf = typst.compile(str(root / "report.typ"), font_paths=[str(fonts)], ignore_system_fonts=True)
    assert isinstance(pdf, bytes)
    return pdf


def _content(report: Report, root: Path) -> dict[str, Any]:
    words, numbers = report.words, numbering(report)
    thai = words.lang == "th"

    def picture(figure: Figure) -> dict[str, Any]:
        file = f"{figure.key}.svg"
        (root / file).write_text(figure.svg, encoding="utf-8")
        return {
            "kind": "figure",
            "file": file,
            "number": numbers[figure.key],
            "caption": rich(figure.caption),
            "alt": bare(figure.caption),
            "width": width_percent(figure),
        }

    def block(item: Block) -> dict[str, Any]:
        if isinstance(item, Figure):
            return picture(item)
        if isinstance(item, Table):
            item = item.steady
            return {
                "kind": "table",
                "number": numbers[item.key],
                "caption": rich(item.caption),
                "header": [rich(cell) for cell in item.header],
                "rows": [[rich(cell) for cell in row] for row in item.rows],
                "mark": -1 if item.mark is None else item.mark,
                "columns": column_kinds(item),
            }
        if isinstance(item, Equation):
            if item.svg:
                (root / "equation.svg").write_text(item.svg, encoding="utf-8")
            width = re.search(r'width="([\d.]+)pt"', item.svg)
            return {
                "kind": "equation",
                "file": "equation.svg" if item.svg else "",
                "latex": item.latex,
                "width_pt": float(width[1]) if width else 300.0,
            }
        return {"kind": "text", "text": rich(item.text), "items": [rich(line) for line in item.items]}

    def side_by_side(row: list[Block]) -> dict[str, Any]:
        return {"kind": "row", "figures": [picture(item) for item in row if isinstance(item, Figure)]}

    return {
        "lang": words.lang,
        "fonts": ["Noto Sans Thai", "Libertinus Serif"] if thai else ["Libertinus Serif", "Noto Sans Thai"],
        "size": 9.2 if thai else 10,
        "leading": 0.85 if thai else 0.62,
        "title": report.title,
        "subtitle": report.subtitle,
        "lead": rich(report.lead),
        "answers_word": words("page.answers"),
        "verdicts_word": words("page.verdicts"),
        "figure_word": words("page.figure"),
        "table_word": words("page.table"),
        "facts": [
            {"question": rich(f.question), "answer": rich(f.answer), "remark": rich(f.remark)} for f in report.facts
        ],
        "verdicts": [
            {
                "verdict": v.verdict,
                "title": rich(v.title),
                "label": v.label,
                "sentence": rich(v.sentence),
                "remedy": rich(v.remedy),
                "figure": picture(v.figure) if v.figure else None,
            }
            for v in report.verdicts
        ],
        "cautions_word": words("page.cautions"),
        "cautions": [rich(line) for line in report.cautions],
        "sections": [
            {
                "title": s.title,
                "blocks": [block(row[0]) if len(row) == 1 else side_by_side(row) for row in lines(s.blocks)],
            }
            for s in report.sections
        ],
        "footer": rich(report.footer),
    }
