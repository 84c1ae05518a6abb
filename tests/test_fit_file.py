"""fit.json and residuals.csv are what the design's section 5 says, and valid JSON even when a fit failed."""

from __future__ import annotations

import csv
import json
import math

from synthetic_swing import swing

from toolkit.diagnose import diagnose
from toolkit.fit import choose_model, fit, fit_models
from toolkit.fit_file import write_fit_json, write_residuals_csv
from toolkit.scene import Pendulum, Scene


def test_fit_json_has_the_layout_others_rely_on(tmp_path):
    series = swing(duration_s=10)
    scene = Scene(pendulum=Pendulum(mass_kg=0.2))
    fits = fit_models(series, scene)
    findings = diagnose(series, fits, scene)
    write_fit_json(tmp_path / "fit.json", series, fits, findings, choose_model(fits))
    table = json.loads((tmp_path / "fit.json").read_text(encoding="utf-8"))
    assert set(table) == {"series", "preferred", "models", "findings"}
    assert table["preferred"] in table["models"]
    model = table["models"]["small_angle_linear_drag"]
    assert {"parameters", "chi2", "dof", "reduced_chi2", "aic", "bic", "success", "message", "noise"} <= set(model)
    assert {"k_d", "theta0", "phi"} <= set(model["parameters"])
    beside = model["beside_preferred"]
    u = math.hypot(beside["paper_u"], beside["preferred_u"])
    assert beside["difference_sigma"] == (beside["paper"] - beside["preferred"]) / u
    assert model["parameters"]["k_d"].keys() == {"value", "stderr", "unit", "fixed"}
    assert [f["assumption"] for f in table["findings"]][:2] == ["small_angle", "linear_drag"]
    for finding in table["findings"]:
        assert finding["verdict"] in ("holds", "fails", "not_distinguishable")
        assert {"where", "evidence", "sentence"} <= set(finding)


def test_a_failed_fit_is_written_with_nulls(tmp_path):
    series = swing().between(0, 0.05)
    fits = {"full_linear_quadratic_coulomb": fit(series, model="full_linear_quadratic_coulomb")}
    write_fit_json(tmp_path / "fit.json", series, fits, [], "full_linear_quadratic_coulomb")
    model = json.loads((tmp_path / "fit.json").read_text(encoding="utf-8"))["models"]["full_linear_quadratic_coulomb"]
    assert model["success"] is False
    assert model["chi2"] is None
    assert model["message"]


def test_residuals_csv_reads_back(tmp_path):
    series = swing(duration_s=3)
    fits = {"full_linear_drag": fit(series)}
    write_residuals_csv(tmp_path / "residuals.csv", series, fits, "full_linear_drag")
    with (tmp_path / "residuals.csv").open(encoding="utf-8") as lines:
        rows = list(csv.DictReader(lines))
    assert len(rows) == len(series)
    for row, theta in zip(rows, series.theta_rad):
        assert math.isclose(float(row["theta_rad"]), theta, rel_tol=1e-15)
        assert math.isclose(float(row["model_theta_rad"]) + float(row["residual_rad"]), theta, rel_tol=1e-12)
