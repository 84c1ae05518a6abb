"""Uncertainty budgets as tables: the fit's own and what no fit can know (clock, g)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from toolkit.errors import PendulabError
from toolkit.report.document import Paragraph, Section, Table
from toolkit.report.material import DRAGS, Material, parameter
from toolkit.report.numbers import bare, number, with_uncertainty
from toolkit.report.speech import symbol

if TYPE_CHECKING:
    from toolkit.fitting.budget import Row

_CLOCK_HALF_WIDTH = 50e-6
_G_HALF_WIDTH = 0.026
_BY_CLOCK = {
    "T0": 1.0,
    "g_from_length": -2.0,
    "equivalent_length": 2.0,
    "k_d": -1.0,
    "alpha_d": -1.0,
    "c": 0.0,
    "beta": 0.0,
    "torque": -2.0,
    "mu": -2.0,
}
"""Power of the unit of time in each quantity: how a relative error of the clock passes into it."""


@dataclass(frozen=True)
class Summed:
    """One quantity's sources of uncertainty (the fit's own and those assumed here) and what they add up to."""

    estimate: float
    unit: str
    rows: tuple[Row, ...]

    @property
    def statistical(self) -> float:
        """Root sum of squares of the sources of type A."""
        return math.sqrt(sum(r.contribution**2 for r in self.rows if r.kind == "A"))

    @property
    def systematic(self) -> float:
        """Root sum of squares of the sources of type B."""
        return math.sqrt(sum(r.contribution**2 for r in self.rows if r.kind == "B"))

    @property
    def u(self) -> float:
        """Combined standard uncertainty."""
        return math.hypot(self.statistical, self.systematic)

    @property
    def coverage_factor(self) -> float:
        """Student's quantile for 95 % at the effective degrees of freedom (Welch and Satterthwaite)."""
        from scipy.special import stdtrit

        fourth = sum(r.contribution**4 / r.dof for r in self.rows if r.dof > 0)
        return float(stdtrit(min(self.u**4 / fourth if fourth > 0 else math.inf, 1e9), 0.975))


def summed(material: Material, name: str) -> Summed | None:
    """The budget of a quantity of the full-sine fit; None for one that the fit did not find, or not above its error."""
    from toolkit.fitting.budget import Row, budget

    result, environment = material.full_sine, material.analysis.scene.environment
    found = result.parameters.get(name) if name in DRAGS else parameter(result, name)
    if (
        name not in _BY_CLOCK
        or found is None
        or not result.success
        or (name in DRAGS and not (found.stderr and found.value > found.stderr))
    ):
        return None
    try:
        drawn = budget(result, name)
    except PendulabError:
        return None
    rows = [row for row in drawn.rows if row.contribution]
    assumed = [("time_scale", "1", 1.0, _CLOCK_HALF_WIDTH, _BY_CLOCK[name] * drawn.estimate)]
    if name == "equivalent_length" and environment.g_m_per_s2 is None and environment.latitude_deg is None:
        g = environment.gravity_m_per_s2
        assumed.append(("g", "m/s²", g, _G_HALF_WIDTH, drawn.estimate / g))
    for source, unit, estimate, half, sensitivity in assumed:
        u = half / math.sqrt(3)
        if sensitivity and all(row.quantity != source for row in rows):
            rows.append(Row(source, estimate, unit, u, "B", "rectangular", sensitivity, sensitivity * u, math.inf))
    return Summed(drawn.estimate, drawn.unit, tuple(rows))


def budget_section(material: Material) -> Section | None:
    """GUM budgets of the drag coefficients, of T₀, of the length and of g, as far as they were found."""
    words = material.words
    names = (*DRAGS, "T0", "equivalent_length", "g_from_length")
    tables = [_table(material, name, found) for name in names if (found := summed(material, name)) is not None]
    if not tables:
        return None
    return Section("budget", words("section.budget"), (Paragraph(words("text.budget")), *tables))


def _table(material: Material, name: str, found: Summed) -> Table:
    words, factor = material.words, found.coverage_factor
    lines = [
        (
            words.either(f"budget.{row.quantity}", row.quantity),
            with_uncertainty(row.estimate, None, row.unit),
            with_uncertainty(row.u, None, row.unit, 2),
            row.kind,
            words(f"budget.{row.distribution}"),
            number(row.sensitivity, 3),
            with_uncertainty(abs(row.contribution), None, found.unit, 2),
        )
        for row in found.rows
    ]
    for key, part in (
        ("statistical_total", found.statistical),
        ("systematic_total", found.systematic),
        ("total", found.u),
    ):
        lines.append((words(f"budget.{key}"), "", "", "", "", "", with_uncertainty(part, None, found.unit, 2)))
    header = tuple(
        words(f"column.{c}")
        for c in ("source", "value", "uncertainty", "kind", "distribution", "sensitivity", "contribution")
    )
    caption = words(
        "budget.title",
        quantity=symbol(words, name),
        value=with_uncertainty(found.estimate, found.u, found.unit),
        expanded=with_uncertainty(factor * found.u, None, found.unit, 2),
        k=number(factor, 3),
    )
    return Table(f"budget_{name}", caption, header, tuple(lines), len(lines) - 1)


def budget_sheet(material: Material) -> dict[str, list[Any]]:
    """The budgets of the report as one table of texts."""
    section = budget_section(material)
    columns: dict[str, list[Any]] = {
        k: [] for k in ("quantity", "source", "value", "u", "type", "distribution", "sensitivity", "contribution")
    }
    for block in section.blocks if section else ():
        if isinstance(block, Table):
            for row in block.rows:
                for column, cell in zip(columns.values(), (block.key.removeprefix("budget_"), *map(bare, row))):
                    column.append(cell)
    return columns
