"""report.md: the same in Markdown, with figures as SVG files in figures/ and their numbers as CSV."""

from __future__ import annotations

from pathlib import Path

from toolkit.report.document import Block, Equation, Figure, Report, Table
from toolkit.report.figure_files import write_figures
from toolkit.report.numbers import rich


def write(report: Report, folder: Path) -> Path:
    """Write report.md and figures/; returns the path of report.md."""
    write_figures(report, folder, ("svg",))
    path = folder / "report.md"
    path.write_text(render(report), encoding="utf-8", newline="\n")
    return path


def render(report: Report) -> str:
    """The document as text."""
    words = report.words
    parts = [f"# {_text(report.title)}: {_text(report.subtitle)}", _text(report.lead), f"## {words('page.answers')}"]
    for fact in report.facts:
        remark = f" ({_text(fact.remark)})" if fact.remark else ""
        parts.append(f"- {_text(fact.question)} **{_text(fact.answer)}**{remark}")
    parts.append(f"## {words('page.verdicts')}")
    for verdict in report.verdicts:
        parts.append(f"### {_text(verdict.title)}: {verdict.label}")
        parts.append(
            f"{_text(verdict.sentence)} *{_text(verdict.remedy)}*" if verdict.remedy else _text(verdict.sentence)
        )
        if verdict.figure:
            parts.append(_block(verdict.figure))
    if report.cautions:
        parts += [f"### {_text(words('page.cautions'))}", "\n".join(f"- {_text(line)}" for line in report.cautions)]
    for section in report.sections:
        parts.append(f"## {_text(section.title)}")
        parts += [_block(block) for block in section.blocks]
    return "\n\n".join([*parts, _text(report.footer)]) + "\n"


def _block(block: Block) -> str:
    if isinstance(block, Figure):
        return f"![{block.key}](figures/{block.key}.svg)\n\n*{_text(block.caption)}*"
    if isinstance(block, Equation):
        return f"$$\n{block.latex}\n$$"
    if isinstance(block, Table):
        rows = [_row(row, i == block.mark) for i, row in enumerate(block.rows)]
        rule = "|" + " --- |" * len(block.header)
        return "\n".join([f"*{_text(block.caption)}*", "", _row(block.header), rule, *rows])
    items = "\n".join(f"- {_text(item)}" for item in block.items)
    return "\n\n".join(part for part in (_text(block.text), items) if part)


def _row(cells: tuple[str, ...], stress: bool = False) -> str:
    shown = (f"**{_text(cell)}**" if stress and cell else _text(cell) for cell in cells)
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in shown) + " |"


def _text(text: str) -> str:
    out = []
    for style, part in rich(text):
        plain = part.replace("&", "&amp;").replace("<", "&lt;").replace("*", "\\*")
        tag = {"sub": "<sub>{}</sub>", "sup": "<sup>{}</sup>", "bold": "**{}**", "code": "`{}`"}.get(style, "{}")
        out.append(tag.format(plain))
    return "".join(out)
