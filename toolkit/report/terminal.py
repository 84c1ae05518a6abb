"""The report's essentials as plain lines for a terminal."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING

from toolkit.report.numbers import bare

if TYPE_CHECKING:
    from toolkit.analyse import Analysis


def summary_lines(analysis: Analysis, lang: str = "en") -> list[str]:
    """What was measured, the answers, the verdicts, and what was noted, one line each (long ones wrapped)."""
    from toolkit.report.essentials import MAIN, facts, lead, notes
    from toolkit.report.material import Material
    from toolkit.report.speech import assumption, remedy, sentence
    from toolkit.report.words import load_words

    words = load_words(lang)
    material = Material(analysis, words)
    lines = [bare(lead(material))]
    for fact in facts(material):
        remark = f"  ({bare(fact.remark)})" if fact.remark else ""
        lines.append(f"{bare(fact.question)}  {bare(fact.answer)}{remark}")
    for finding in analysis.findings:
        if finding.assumption in MAIN:
            title = assumption(words, finding)
            text = f"{bare(title)}: {words(f'verdict.{finding.verdict}')}. {bare(sentence(words, finding))} {bare(remedy(words, finding))}"
            lines += textwrap.wrap(text, 110, subsequent_indent="  ")
    lines += [f"{words('page.note')}: {bare(note)}" for note in notes(material)]
    return lines
