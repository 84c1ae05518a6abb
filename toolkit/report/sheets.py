"""The numbers of a report as sheets for a spreadsheet."""

from __future__ import annotations

from typing import Any

from toolkit.report.budgets import budget_sheet
from toolkit.report.material import Material


def sheets(material: Material) -> dict[str, dict[str, Any]]:
    """Numbers for a spreadsheet: the series with model and residuals, all parameters of all fits, the ladder."""
    series, best = material.analysis.series, material.best
    data: dict[str, Any] = {"t_s": series.t_s, "theta_rad": series.theta_rad}
    if series.sigma_theta_rad is not None:
        data["sigma_theta_rad"] = series.sigma_theta_rad
    if material.usable:
        data |= {
            "theta_model_rad": best.theta_rad,
            "omega_model_rad_per_s": best.omega_rad_per_s,
            "residual_rad": best.residuals_rad,
        }
    parameters: dict[str, list[Any]] = {k: [] for k in ("model", "parameter", "value", "stderr", "unit", "state")}
    ladder: dict[str, list[Any]] = {
        k: [] for k in ("model", "preferred", "success", "chi2", "dof", "reduced_chi2", "aic", "bic", "message")
    }
    for name, result in material.analysis.fits.items():
        for table, state in ((result.parameters, ""), (result.derived, "derived")):
            for key, found in table.items():
                row = (name, key, found.value, found.stderr, found.unit, state or ("held" if found.fixed else "fitted"))
                for column, cell in zip(parameters.values(), row):
                    column.append(cell)
        row2 = (
            name,
            name == material.analysis.preferred,
            result.success,
            result.chi2,
            result.dof,
            result.reduced_chi2,
            result.aic,
            result.bic,
            result.message,
        )
        for column, cell2 in zip(ladder.values(), row2):
            column.append(cell2)
    findings: dict[str, list[Any]] = {k: [] for k in ("assumption", "verdict", "sentence", "remedy")}
    for finding in material.analysis.findings:
        for column, cell3 in zip(
            findings.values(), (finding.assumption, finding.verdict, finding.sentence, finding.remedy)
        ):
            column.append(cell3)
    return {
        "data": data,
        "parameters": parameters,
        "models": ladder,
        "findings": findings,
        "budget": budget_sheet(material),
    }
