"""Uncertainty budgets as tables: the fit's own and what no fit can know (clock, g)."""

from __future__ import annotations

import math
from typing import Any

from toolkit.errors import PendulabError
from toolkit.fit import FitResult
from toolkit.report.document import Paragraph, Section, Table
from toolkit.report.material import DRAGS, Material, parameter
from toolkit.report.numbers import bare, number, with_uncertainty
from toolkit.report.speech import symbol

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


def budget_section(material: Material) -> Section | None:
    """GUM budgets of the drag coefficients, of T₀, of the length and of g, as far as they were found."""
    words, result = material.words, material.full_sine if material.full_sine.success else material.best
    names = [n for n in DRAGS if (p := parameter(result, n)) is not None and p.stderr and p.value > p.stderr]
    names += [n for n in ("T0", "equivalent_length", "g_from_length") if parameter(result, n) is not None]
    tables = [table for name in names if (table := _table(material, result, name)) is not None]
    if not tables:
        return None
    return Section("budget", words("section.budget"), (Paragraph(words("text.budget")), *tables))


def _table(material: Material, result: FitResult, name: str) -> Table | None:
    from scipy.stats import t as student

    from toolkit.fitting.budget import Row, budget

    words, environment = material.words, material.analysis.scene.environment
    try:
        drawn = budget(result, name)
    except PendulabError:
        return None
    rows = list(drawn.rows)
    assumed = [("time_scale", "1", 1.0, _CLOCK_HALF_WIDTH, _BY_CLOCK[name] * drawn.estimate)]
    if name == "equivalent_length" and environment.g_m_per_s2 is None and environment.latitude_deg is None:
        g = environment.gravity_m_per_s2
        assumed.append(("g", "m/s²", g, _G_HALF_WIDTH, drawn.estimate / g))
    for source, unit, estimate, half, sensitivity in assumed:
        u = half / math.sqrt(3)
        if sensitivity and all(row.quantity != source for row in rows):
            rows.append(Row(source, estimate, unit, u, "B", "rectangular", sensitivity, sensitivity * u, math.inf))
    statistical = math.sqrt(sum(r.contribution**2 for r in rows if r.kind == "A"))
    systematic = math.sqrt(sum(r.contribution**2 for r in rows if r.kind == "B"))
    total = math.hypot(statistical, systematic)
    fourth = sum(r.contribution**4 / r.dof for r in rows if r.dof > 0)
    factor = float(student.ppf(0.975, min(total**4 / fourth if fourth > 0 else math.inf, 1e9)))
    lines = [
        (
            words.either(f"budget.{row.quantity}", row.quantity),
            with_uncertainty(row.estimate, None, row.unit),
            with_uncertainty(row.u, None, row.unit, 2),
            row.kind,
            words(f"budget.{row.distribution}"),
            number(row.sensitivity, 3),
            with_uncertainty(abs(row.contribution), None, drawn.unit, 2),
        )
        for row in rows
    ]
    for key, part in (("statistical_total", statistical), ("systematic_total", systematic), ("total", total)):
        lines.append((words(f"budget.{key}"), "", "", "", "", "", with_uncertainty(part, None, drawn.unit, 2)))
    header = tuple(
        words(f"column.{c}")
        for c in ("source", "value", "uncertainty", "kind", "distribution", "sensitivity", "contribution")
    )
    caption = words(
        "budget.title",
        quantity=symbol(words, name),
        value=with_uncertainty(drawn.estimate, total, drawn.unit),
        expanded=with_uncertainty(factor * total, None, drawn.unit, 2),
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
