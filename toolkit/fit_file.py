"""fit.json and residuals.csv."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from toolkit.checks.finding import Finding
from toolkit.fit import FitResult, FittedParameter
from toolkit.fitting.uncertainty import small_angle_bias
from toolkit.output import whole_file
from toolkit.series import ThetaSeries


def write_fit_json(
    path: str | Path,
    series: ThetaSeries,
    fits: Mapping[str, FitResult],
    findings: Sequence[Finding],
    preferred: str,
) -> None:
    """Write fit.json as the design's section 5 lays it out. Numbers that do not exist are null.

    The paper's model has `beside_preferred` too: its k_d (or alpha_d), the preferred model's equivalent linear value at θ₀, u of
    both and their difference in σ.
    """
    table: dict[str, Any] = {
        "series": _series_entry(series),
        "preferred": preferred,
        "models": {name: _model_entry(result) for name, result in fits.items()},
        "findings": [_finding_entry(finding) for finding in findings],
    }
    beside = small_angle_bias(fits, preferred)
    if beside:
        table["models"]["small_angle_linear_drag"]["beside_preferred"] = beside
    with whole_file(path) as scratch:
        scratch.write_text(json.dumps(_plain(table), indent=2, ensure_ascii=False) + "\n", encoding="utf-8")


def write_residuals_csv(path: str | Path, series: ThetaSeries, fits: Mapping[str, FitResult], preferred: str) -> None:
    """Write residuals.csv: the record, the preferred model, and every model's residual in rad."""
    best = fits[preferred]
    columns = {"t_s": series.t_s, "theta_rad": series.theta_rad}
    if series.sigma_theta_rad is not None:
        columns["sigma_theta_rad"] = series.sigma_theta_rad
    columns |= {
        "model_theta_rad": best.theta_rad,
        "model_omega_rad_per_s": best.omega_rad_per_s,
        "residual_rad": best.residuals_rad,
    }
    columns |= {f"residual_{name}_rad": result.residuals_rad for name, result in fits.items()}
    rows = np.stack(list(columns.values()), axis=1)
    with whole_file(path) as scratch, scratch.open("w", encoding="utf-8", newline="\n") as out:
        out.write(",".join(columns) + "\n")
        out.writelines(",".join(repr(float(v)) if math.isfinite(v) else "" for v in row) + "\n" for row in rows)


def _series_entry(series: ThetaSeries) -> dict[str, Any]:
    step = np.diff(series.t_s)
    return {
        "source": str(series.meta.get("source", "")),
        "points": len(series),
        "duration_s": series.duration_s,
        "median_step_s": float(np.median(step)) if step.size else None,
        "sigma_known": series.sigma_theta_rad is not None,
        "theta_min_rad": float(series.theta_rad.min()),
        "theta_max_rad": float(series.theta_rad.max()),
        "warnings": list(series.meta.get("warnings", [])),
    }


def _model_entry(result: FitResult) -> dict[str, Any]:
    return {
        "parameters": {name: _parameter_entry(p) for name, p in result.parameters.items()},
        "derived": {name: _parameter_entry(p) for name, p in result.derived.items()},
        "free": list(result.free),
        "covariance": result.covariance.tolist(),
        "chi2": result.chi2,
        "dof": result.dof,
        "reduced_chi2": result.reduced_chi2,
        "aic": result.aic,
        "bic": result.bic,
        "success": result.success,
        "message": result.message,
        "warnings": list(result.warnings),
        "method": result.method,
        "equation_latex": result.equation_latex,
        "noise": dict(result.noise),
    }


def _parameter_entry(parameter: FittedParameter) -> dict[str, Any]:
    return {
        "value": parameter.value,
        "stderr": parameter.stderr,
        "unit": parameter.unit,
        "fixed": parameter.fixed,
    }


def _finding_entry(finding: Finding) -> dict[str, Any]:
    return {
        "assumption": finding.assumption,
        "verdict": finding.verdict,
        "where": dict(finding.where),
        "evidence": dict(finding.evidence),
        "sentence": finding.sentence,
        "remedy": finding.remedy,
        "strength_sigma": finding.strength_sigma,
    }


def _plain(value: Any) -> Any:
    """The same with NumPy's numbers as Python's and those that are not finite as None: JSON has no NaN."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, np.generic):
        return _plain(value.item())
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value
