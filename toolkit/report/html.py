"""report.html: one file, everything inside it, no request to anywhere; light and dark; prints well."""

from __future__ import annotations

import base64
from importlib.resources import files
from pathlib import Path
from typing import Any

from toolkit.report.document import Report, Table
from toolkit.report.numbers import bare, rich
from toolkit.report.paper import lines, width_percent
from toolkit.report.style import with_css_colours


def write(report: Report, folder: Path) -> Path:
    """Write report.html; returns its path."""
    path = folder / "report.html"
    path.write_text(render(report), encoding="utf-8", newline="\n")
    return path


def render(report: Report) -> str:
    """The page as text."""
    from jinja2 import Environment
    from markupsafe import Markup

    folder = files("toolkit.report") / "templates"
    environment = Environment(autoescape=True, trim_blocks=False)
    template = environment.from_string((folder / "report.html").read_text(encoding="utf-8"))

    def inline(item: Any) -> Any:
        label = bare(getattr(item, "caption", "") or getattr(item, "latex", ""))
        svg = with_css_colours(item.svg)
        return Markup(svg.replace("<svg ", Markup('<svg role="img" aria-label="{}" ').format(label), 1))

    return template.render(
        report=report,
        style=Markup(page_style(report.words.lang)),
        word=report.words,
        marks=rich,
        plain=bare,
        inline=inline,
        kind_of=lambda block: type(block).__name__,
        number_of=numbering(report),
        lines=lines,
        width_of=width_percent,
    )


def numbering(report: Report) -> dict[str, int]:
    """Key of each figure and table -> its number, figures and tables counted apart, in reading order."""
    numbers = {figure.key: n for n, figure in enumerate(report.figures, 1)}
    tables = [block for section in report.sections for block in section.blocks if isinstance(block, Table)]
    return numbers | {table.key: n for n, table in enumerate(tables, 1)}


def page_style(lang: str) -> str:
    """The style sheet of our pages, with the Thai font inside where the language needs it."""
    style = (files("toolkit.report") / "templates" / "report.css").read_text(encoding="utf-8")
    return font_face() + style.replace("font:16px/1.55 ", 'font:16px/1.7 "Noto Sans Thai",') if lang == "th" else style


def font_face() -> str:
    """The Thai font as CSS."""
    faces = []
    for name, weight in (("Regular", 400), ("Bold", 700)):
        data = (files("toolkit.report") / "fonts" / f"NotoSansThai-{name}.ttf").read_bytes()
        url = f"data:font/ttf;base64,{base64.b64encode(data).decode('ascii')}"
        faces.append(
            f'@font-face{{font-family:"Noto Sans Thai";font-weight:{weight};src:url({url}) format("truetype");unicode-range:U+0-2211,U+2213-FFFF}}\n'
        )
    return "".join(faces)
