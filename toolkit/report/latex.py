"""report.tex: a fragment to \\input, with its figures as files in figures/ and every figure's numbers beside it."""

from __future__ import annotations

from pathlib import Path

from toolkit.report.document import Block, Equation, Figure, Report, Table
from toolkit.report.figure_files import write_figures
from toolkit.report.numbers import bare, rich
from toolkit.report.paper import lines, width_percent

_SPECIAL = {
    "\\": r"\textbackslash{}",
    "{": r"\{",
    "}": r"\}",
    "&": r"\&",
    "%": r"\%",
    "$": r"\$",
    "#": r"\#",
    "_": r"\_",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": r"\ensuremath{<}",
    ">": r"\ensuremath{>}",
    "|": r"\ensuremath{|}",
    "°": r"\ensuremath{^\circ}",
    "±": r"\ensuremath{\pm}",
    "×": r"\ensuremath{\times}",
    "−": r"\ensuremath{-}",
    "≈": r"\ensuremath{\approx}",
    "√": r"\ensuremath{\sqrt{}}",
    "²": r"\ensuremath{^2}",
    "·": r"\ensuremath{\cdot}",
    "σ": r"\ensuremath{\sigma}",
    "θ": r"\ensuremath{\theta}",
    "α": r"\ensuremath{\alpha}",
    "β": r"\ensuremath{\beta}",
    "μ": r"\ensuremath{\mu}",
    "τ": r"\ensuremath{\tau}",
    "φ": r"\ensuremath{\phi}",
    "ψ": r"\ensuremath{\psi}",
    "ω": r"\ensuremath{\omega}",
    "χ": r"\ensuremath{\chi}",
    "Δ": r"\ensuremath{\Delta}",
    "Λ": r"\ensuremath{\Lambda}",
    "ℓ": r"\ensuremath{\ell}",
    "–": "--",
    "“": "``",
    "”": "''",
    "θ̇": r"\ensuremath{\dot\theta}",
}
_SPECIAL |= {raised: rf"\ensuremath{{^{{{plain}}}}}" for raised, plain in zip("⁰¹³⁴⁵⁶⁷⁸⁹⁺⁻", "013456789+-")}
_RAGGED = r">{\raggedright\arraybackslash}p"
_HEAD = r"""% A fragment. With pdfLaTeX, XeLaTeX or LuaLaTeX:
%   \documentclass{article}
%   \usepackage{graphicx,booktabs,array,amsmath}
%   \begin{document}\input{report.tex}\end{document}
% Figures are PDF files in figures/, their numbers CSV files of the same name.
"""
_HEAD_THAI = r"""% A fragment in Thai. With XeLaTeX and a Thai font, for example Noto Sans Thai:
%   \documentclass{article}
%   \usepackage{graphicx,booktabs,array,amsmath,fontspec}
%   \setmainfont{Noto Sans Thai}
%   \XeTeXlinebreaklocale "th"  % lines break between Thai words
%   \begin{document}\input{report.tex}\end{document}
% Figures are PDF files in figures/, their numbers CSV files of the same name.
"""


def write(report: Report, folder: Path) -> Path:
    """Write report.tex and figures/; returns the path of report.tex."""
    write_figures(report, folder, ("pdf", "svg"))
    path = folder / "report.tex"
    path.write_text(render(report), encoding="utf-8", newline="\n")
    return path


def render(report: Report) -> str:
    """The fragment as text."""
    words = report.words
    parts = [
        _HEAD_THAI if words.lang == "th" else _HEAD,
        f"\\section*{{{_text(report.title)}: {_text(report.subtitle)}}}",
        _text(report.lead),
        "",
    ]
    parts += [r"\begingroup\sloppy", "\\begin{description}"]
    for fact in report.facts:
        remark = f" {{\\small {_text(fact.remark)}}}" if fact.remark else ""
        parts.append(f"\\item[{_text(fact.question)}] {_text(fact.answer)}.{remark}")
    parts += ["\\end{description}", f"\\subsection*{{{_text(words('page.verdicts'))}}}"]
    for verdict in report.verdicts:
        title = f"\\paragraph{{{_text(verdict.title)}: {_text(verdict.label)}.}}"
        parts += [f"{title} {_text(verdict.sentence)} {_text(verdict.remedy)}", ""]
        if verdict.figure:
            parts.append(_figures([verdict.figure]))
    if report.cautions:
        parts += [f"\\paragraph{{{_text(words('page.cautions'))}.}}", " ".join(map(_text, report.cautions)), ""]
    for section in report.sections:
        parts.append(f"\\subsection*{{{_text(section.title)}}}")
        for row in lines(section.blocks):
            figures = [block for block in row if isinstance(block, Figure)]
            parts.append(_figures(figures) if figures else _block(row[0]))
    return "\n".join([*parts, _text(report.footer), r"\par\endgroup", ""])


def _figures(row: list[Figure]) -> str:
    """One floating figure, or several side by side."""
    pictures = []
    for figure in row:
        caption = f"\\caption{{{_text(figure.caption)}}}\\label{{fig:{figure.key}}}"
        width = width_percent(figure) / 100
        inner = "" if len(row) == 1 else f"\\begin{{minipage}}[t]{{{0.98 * width:.3f}\\linewidth}}"
        shown = f"{width:.3f}\\linewidth" if len(row) == 1 else "\\linewidth"
        picture = f"\\includegraphics[width={shown}]{{figures/{figure.key}}}\n{caption}"
        pictures.append(inner + picture + ("\\end{minipage}" if inner else ""))
    return "\\begin{figure}[htbp]\\centering " + "\\hfill\n".join(pictures) + "\\end{figure}\n"


def _block(block: Block) -> str:
    if isinstance(block, Figure):
        return _figures([block])
    if isinstance(block, Equation):
        return f"\\begin{{equation}}\n{block.latex}\n\\end{{equation}}\n"
    if isinstance(block, Table):
        rows = [" & ".join(_text(cell) for cell in row) + r" \\" for row in block.rows]
        if block.mark is not None:
            cells = (f"\\textbf{{{_text(cell)}}}" for cell in block.rows[block.mark])
            rows[block.mark] = " & ".join(cells) + r" \\"
        head = " & ".join(_text(cell) for cell in block.header) + r" \\"
        shape = "".join(f"{_RAGGED}{{{share:.3f}\\linewidth}}" for share in _shares(block))
        return "\n".join(
            [
                f"\\begin{{table}}[htbp]\\footnotesize\\setlength{{\\tabcolsep}}{{3pt}}\\caption{{{_text(block.caption)}}}\\label{{tab:{block.key}}}",
                f"\\begin{{tabular}}{{{shape}}}\\toprule",
                head + r"\midrule",
                *rows,
                "\\bottomrule\\end{tabular}\\end{table}\n",
            ]
        )
    listed = "\n".join(f"\\item {_text(item)}" for item in block.items)
    return _text(block.text) + (f"\n\\begin{{itemize}}\n{listed}\n\\end{{itemize}}" if listed else "") + "\n"


def _shares(table: Table) -> list[float]:
    """Each column's share of the line, by its longest cell, but never narrower than its longest word."""
    columns = list(zip(table.header, *table.rows))
    longest = [max(len(bare(cell)) for cell in column) for column in columns]
    words = [max(len(word) for cell in column for word in bare(cell).split() or [""]) for column in columns]
    weights = [max(word + 1, min(length, 26)) for word, length in zip(words, longest)]
    return [(1 - 0.018 * len(columns)) * weight / sum(weights) for weight in weights]


def _text(text: str) -> str:
    marks = {
        "sub": r"\ensuremath{{_{{\mathrm{{{}}}}}}}",
        "sup": r"\ensuremath{{^{{\mathrm{{{}}}}}}}",
        "bold": r"\textbf{{{}}}",
        "code": r"\texttt{{{}}}",
    }
    out = []
    for style, part in rich(text):
        plain = "".join(_SPECIAL.get(c, c) for c in part)
        if style == "code":
            plain = plain.replace("-", "{-}")  # or two make a dash
        out.append(marks[style].format(plain) if style in marks else plain)
    return "".join(out)
