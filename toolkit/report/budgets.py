"""Uncertainty budgets as tables: the fit's own and what no fit can know (clock, g)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from toolkit.errors import PendulabError
from toolkit.report.document import Paragraph, Section, Table
from toolkit.report.material import DRAGS, Material, parameter
from toolkit.report.numbers import bare, number, with_uncertainty
from toolkit.report.speech import symbol

if TYPE_CHECKING:
    from toolkit.fitting.budget import Budget

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


def whole_budget(material: Material, name: str) -> Budget | None:
    """The budget of a quantity of the full-sine fit, with what is assumed here added; None for one that the fit did not find,
    or not above its error."""
    from toolkit.fitting.budget import Input, Row, add_up, budget

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
        u = Input(half, "rectangular").u
        if sensitivity and all(row.quantity != source for row in rows):
            rows.append(Row(source, estimate, unit, u, "B", "rectangular", sensitivity, sensitivity * u, math.inf))
    return add_up(name, drawn.estimate, drawn.unit, rows)


def budget_section(material: Material) -> Section | None:
    """GUM budgets of the drag coefficients, of T₀, of the length and of g, as far as they were found."""
    words = material.words
    names = (*DRAGS, "T0", "equivalent_length", "g_from_length")
    tables = [_table(material, name, found) for name in names if (found := whole_budget(material, name)) is not None]
    if not tables:
        return None
    return Section("budget", words("section.budget"), (Paragraph(words("text.budget")), *tables))


def _table(material: Material, name: str, found: Budget) -> Table:
    words = material.words
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
        ("statistical_total", found.u_statistical),
        ("systematic_total", found.u_systematic),
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
        expanded=with_uncertainty(found.expanded, None, found.unit, 2),
        k=number(found.coverage_factor, 3),
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
