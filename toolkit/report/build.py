"""From an Analysis to a Report: essentials first, then the details."""

from __future__ import annotations

from typing import TYPE_CHECKING

from toolkit.report import details, essentials
from toolkit.report.budgets import budget_section
from toolkit.report.document import Report
from toolkit.report.material import Material
from toolkit.report.sheets import sheets
from toolkit.report.words import load_words

if TYPE_CHECKING:
    from toolkit.analyse import Analysis

SECTIONS = (
    details.experiment,
    details.equation,
    details.motion,
    details.residuals,
    details.models,
    budget_section,
    details.checks,
    details.cost,
    details.methods,
    details.references,
)


def build(analysis: Analysis, lang: str) -> Report:
    """The report in a language. Raises UsageError for an unknown one."""
    from toolkit import __version__

    words = load_words(lang)
    material = Material(analysis, words)
    sections = (section(material) for section in SECTIONS)
    return Report(
        title=words("page.title"),
        subtitle=analysis.source.name,
        lead=essentials.lead(material),
        facts=essentials.facts(material),
        verdicts=essentials.verdicts(material),
        sections=tuple(s for s in sections if s is not None),
        footer=words("page.footer", version=__version__),
        words=words,
        cautions=essentials.cautions(material),
        sheets=sheets(material),
    )
