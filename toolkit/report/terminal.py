"""The report's essentials as plain lines for a terminal."""

from __future__ import annotations

import shutil
import unicodedata
from typing import TYPE_CHECKING

from toolkit.report.numbers import unmarked

if TYPE_CHECKING:
    from toolkit.analyse import Analysis

_WIDEST = 110  # cells: longer lines are hard to read


def summary_lines(analysis: Analysis, lang: str = "en", width: int | None = None) -> list[str]:
    """What was measured, the answers, the verdicts, and what to read with care; lines of `width` cells, the terminal's or
    110 at most. What follows a line of its own is indented."""
    from toolkit.report.essentials import MAIN, cautions, facts, lead
    from toolkit.report.material import Material
    from toolkit.report.speech import assumption, remedy, sentence
    from toolkit.report.words import load_words

    words = load_words(lang)
    material = Material(analysis, words)
    told = [lead(material)]
    for fact in facts(material):
        told.append(f"{fact.question}  {fact.answer}" + (f"  ({fact.remark})" if fact.remark else ""))
    for finding in analysis.findings:
        if finding.assumption in MAIN:
            verdict = words("language.sentence", text=words(f"verdict.{finding.verdict}"))
            text = f"{assumption(words, finding)}: {verdict} {sentence(words, finding)} {remedy(words, finding)}"
            told.append(text.rstrip())
    told += [f"{words('page.note')}: {line}" for line in cautions(material)]
    cells = width or min(_WIDEST, shutil.get_terminal_size((_WIDEST, 24)).columns)
    return [line for text in told for line in _wrapped(unmarked(text), cells)]


def _wrapped(text: str, cells: int) -> list[str]:
    """Lines broken at spaces, the second and later ones indented. A word longer than a line, as a Thai phrase may be, is left to the
    terminal, which breaks no letter from its marks."""
    first, *rest = text.split(" ")
    lines = [first]
    for word in rest:
        if _cells(lines[-1]) + 1 + _cells(word) <= cells:
            lines[-1] += f" {word}"
        else:
            lines.append(f"  {word}")
    return [line.rstrip().replace("\u00a0", " ") for line in lines]


def _cells(text: str) -> int:
    """How many cells of a terminal a text takes: the vowels and tones above and below a Thai letter take none."""
    return sum(unicodedata.category(letter) != "Mn" for letter in text)
