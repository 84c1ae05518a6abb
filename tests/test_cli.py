"""The command as a person meets it: what it writes, what it says, how it ends."""

from __future__ import annotations

import contextlib
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

ROOT = Path(__file__).resolve().parents[1]


def pendulab(*words: object, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, str(ROOT / "cli.py"), *map(str, words)],
        capture_output=True,
        text=True,
        encoding="utf-8",
        cwd=cwd,
        env={**os.environ, "PENDULAB_DEBUG": ""},
        check=False,
    )


def refused(done: subprocess.CompletedProcess[str], code: int, *words: str) -> None:
    """One clear line, the right exit code, no traceback."""
    assert done.returncode == code, done.stderr
    assert "Traceback" not in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1, done.stderr
    assert "unexpected trouble" not in done.stderr
    for word in words:
        assert word in done.stderr


def swing(path: Path, *, seconds: float = 12.0, header: str = "t_s,theta_rad", sep: str = ",") -> Path:
    """A damped pendulum's swing (an exact small-angle solution) with a little noise, as a file."""
    t = np.arange(0, seconds, 1 / 30)
    theta = 0.1 * np.exp(-0.02 * t) * np.cos(4.4 * t) + np.random.default_rng(3).normal(0, 1e-3, t.size)
    rows = [header, *(sep.join(f"{v:.9g}" for v in row) for row in zip(t, theta, strict=True))]
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def demo(tmp_path_factory) -> tuple[Path, subprocess.CompletedProcess[str]]:
    out = tmp_path_factory.mktemp("demo") / "out"
    return out, pendulab("demo", "--out", out)


def test_demo_writes_the_whole_job(demo):
    out, done = demo
    assert done.returncode == 0, done.stderr
    names = {p.name for p in out.iterdir()}
    expected = "track.csv theta.csv calibration.json fit.json residuals.csv report.html report.pdf overlay.mp4"
    assert names >= set(expected.split())
    assert str(out / "report.html") in done.stdout
    assert done.stderr == ""  # quiet when not a terminal


def test_the_files_have_the_promised_columns_and_keys(demo):
    out, _ = demo
    track = pd.read_csv(out / "track.csv")
    assert list(track.columns)[:7] == ["frame", "t_s", "x_px", "y_px", "sigma_x_px", "sigma_y_px", "status"]
    assert track.frame.iloc[0] == 0
    assert set(track.status) <= {"ok", "predicted", "lost"}
    theta = pd.read_csv(out / "theta.csv")
    assert list(theta.columns) == ["t_s", "theta_rad", "sigma_theta_rad"]
    assert len(theta) == (track.status == "ok").sum()  # measured frames only
    calibration = json.loads((out / "calibration.json").read_text(encoding="utf-8"))
    assert {"pivot_px", "radius_px", "vertical_rad", "fps", "time_source"} <= set(calibration)
    fit = json.loads((out / "fit.json").read_text(encoding="utf-8"))
    assert {"series", "preferred", "models", "findings"} <= set(fit)
    assert set(fit["models"]) >= {
        "small_angle_linear_drag",
        "full_linear_drag",
        "full_quadratic_drag",
        "full_linear_quadratic_drag",
        "full_linear_quadratic_coulomb",
    }
    assert fit["preferred"] in fit["models"]
    for model in fit["models"].values():
        assert {"parameters", "chi2", "dof", "reduced_chi2", "aic", "bic", "success", "message", "noise"} <= set(model)
        for parameter in model["parameters"].values():
            assert {"value", "stderr", "unit", "fixed"} <= set(parameter)
    verdicts = {finding["assumption"]: finding["verdict"] for finding in fit["findings"]}
    assert {"small_angle", "linear_drag"} <= set(verdicts)
    assert set(verdicts.values()) <= {"holds", "fails", "not_distinguishable"}
    residuals = pd.read_csv(out / "residuals.csv")
    assert len(residuals) == len(theta)


def test_demo_finds_the_truth_of_its_sample(demo):
    """θ within 0.01° rms of the renderer's truth."""
    out, _ = demo
    theta = pd.read_csv(out / "theta.csv")
    truth = pd.read_csv(ROOT / "data" / "samples" / "pendulum.truth.csv")
    # both count t from the first frame; the truth's time is mid-exposure, so compare frame by frame
    assert len(theta) == len(truth)
    error_deg = np.degrees(theta.theta_rad - truth.theta_rad)
    assert np.sqrt(np.mean(error_deg**2)) < 0.01


def test_fit_and_report_of_a_series(tmp_path):
    series = swing(tmp_path / "swing.csv")
    done = pendulab(
        "report", series, "--mass-kg", 0.25, "--length-m", 0.5, "--out", tmp_path / "out", "--format", "html,md"
    )
    assert done.returncode == 0, done.stderr
    fit = json.loads((tmp_path / "out" / "fit.json").read_text(encoding="utf-8"))
    paper = fit["models"]["small_angle_linear_drag"]["parameters"]
    assert paper["k_d"]["unit"] == "kg/s"
    # truth: α_d = 0.02 1/s, so k_d = 2 m α_d = 0.01 kg/s
    assert abs(paper["k_d"]["value"] - 0.01) < 4 * paper["k_d"]["stderr"]
    assert abs(paper["theta0"]["value"] - 0.1) < 4 * paper["theta0"]["stderr"]


def test_without_a_mass_no_k_d_is_invented(tmp_path):
    done = pendulab("fit", swing(tmp_path / "swing.csv"), "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    fit = json.loads((tmp_path / "out" / "fit.json").read_text(encoding="utf-8"))
    for model in fit["models"].values():
        assert "k_d" not in model["parameters"]
    alpha = fit["models"]["small_angle_linear_drag"]["parameters"]["alpha_d"]
    assert abs(alpha["value"] - 0.02) < 4 * alpha["stderr"]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", ["empty"]),
        (b"this is a letter, not a film", ["video"]),
        (b"\x00\x00\x00\x18ftypmp42\x00\x00\x00\x00mp42isom", ["video"]),
    ],
)
def test_files_that_are_no_videos(tmp_path, content, words):
    path = tmp_path / "clip.mp4"
    path.write_bytes(content)
    refused(pendulab("report", path, "--out", tmp_path / "out"), 1, "clip.mp4", *words)
    assert not (tmp_path / "out").exists()


def test_a_truncated_video_is_used_or_refused_in_one_line(tmp_path):
    whole = (ROOT / "data" / "samples" / "pendulum.mp4").read_bytes()
    path = tmp_path / "cut.mp4"
    path.write_bytes(whole[: len(whole) // 2])
    done = pendulab("track", path, "--out", tmp_path / "out")
    if done.returncode != 0:
        refused(done, 1, "cut.mp4")
        assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("name", ["nothing.mp4", "nothing.csv", "nothing"])
def test_missing_files(tmp_path, name):
    refused(pendulab("report", tmp_path / name, "--out", tmp_path / "out"), 1, name, "does not exist")
    assert not (tmp_path / "out").exists()


def test_a_folder_without_pictures(tmp_path):
    (tmp_path / "folder").mkdir()
    refused(pendulab("track", tmp_path / "folder", "--out", tmp_path / "out"), 1, "folder")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", ["empty"]),
        ("t_s,theta_rad\n", []),
        ("colour,price\nred,3\nblue,4\n", []),
        ("t_s,theta_rad\n0,a\n1,b\n2,c\n", []),
        ("t_s,theta_rad\n0,nan\n1,nan\n2,nan\n", []),
        ("t_s,theta_rad\n0,0.1\n", []),
    ],
)
def test_tables_that_are_no_swing(tmp_path, text, words):
    path = tmp_path / "table.csv"
    path.write_text(text, encoding="utf-8")
    refused(pendulab("fit", path, "--out", tmp_path / "out"), 1, "table.csv", *words)
    assert not (tmp_path / "out").exists()


def test_nan_rows_and_gaps_are_left_out_and_told(tmp_path):
    path = swing(tmp_path / "swing.csv")
    lines = path.read_text(encoding="utf-8").splitlines()
    lines[5] = lines[5].split(",")[0] + ",nan"
    del lines[100:160]
    path.write_text("\n".join(lines), encoding="utf-8")
    done = pendulab("fit", path, "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert "note: " in done.stdout


def test_unsorted_and_duplicate_times_get_a_clear_word(tmp_path):
    path = swing(tmp_path / "swing.csv")
    lines = path.read_text(encoding="utf-8").splitlines()
    lines[10], lines[11] = lines[11], lines[10]
    lines.insert(20, lines[20])
    path.write_text("\n".join(lines), encoding="utf-8")
    done = pendulab("fit", path, "--out", tmp_path / "out")
    if done.returncode == 0:
        assert "note: " in done.stdout
    else:
        refused(done, 1, "swing.csv")


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (["--mass-kg", -1], 2, "mass_kg"),
        (["--length-m", 0], 2, "length_m"),
        (["--length-m", "long"], 2, "--length-m"),
        (["--pivot", "3,4"], 2, "--pivot"),
        (["--lang", "xx"], 2, "xx"),
        (["--format", "doc"], 2, "doc"),
        (["--model", "full_cubic_drag"], 2, "full_cubic_drag"),
        (["--start", 100], 2, "100"),
        (["--nonsense"], 2, "--nonsense"),
        (["--overlay"], 2, "are for videos"),
        (["--length-m", 1e300], 2, "too large"),
    ],
)
def test_wrong_use(tmp_path, words, code, said):
    done = pendulab("report", swing(tmp_path / "swing.csv"), "--out", tmp_path / "out", *words)
    refused(done, code, said)
    assert not (tmp_path / "out").exists()


def test_what_is_no_subject_of_cost_and_no_place_for_a_film(tmp_path):
    refused(pendulab("cost", "problems", "--out", tmp_path / "out"), 2, "fit, integrators, tracking")
    (tmp_path / "taken.mp4").mkdir()
    scene = ROOT / "data" / "samples" / "pendulum.toml"
    refused(pendulab("render", scene, "--out", tmp_path / "taken.mp4"), 2, "is a folder")


def test_a_record_that_does_not_move_is_reported(tmp_path):
    """The fits fail, and the report says so."""
    rows = "".join(f"{i / 60},0.1,0.001\n" for i in range(300))
    (tmp_path / "still.csv").write_text("t_s,theta_rad,sigma_theta_rad\n" + rows, encoding="utf-8")
    done = pendulab("report", tmp_path / "still.csv", "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert "no fit converged" in done.stdout
    assert (tmp_path / "out" / "report.pdf").is_file()
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "model preferred by the data" not in page  # nor are the failed fit's numbers shown


def test_wrong_points_and_factors(tmp_path):
    clip = ROOT / "data" / "samples" / "pendulum.mp4"
    refused(pendulab("track", clip, "--pivot", "3", "--out", tmp_path / "out"), 2, "--pivot")
    refused(pendulab("track", clip, "--bob", "a,b", "--out", tmp_path / "out"), 2, "--bob")
    refused(pendulab("track", clip, "--fps-factor", 0, "--out", tmp_path / "out"), 2, "--fps-factor")
    refused(pendulab("track", clip, "--localiser", "nobody", "--out", tmp_path / "out"), 2, "nobody")


def test_a_scene_with_a_misspelt_key(tmp_path):
    scene = tmp_path / "scene.toml"
    scene.write_text("[pendulum]\nmass_k = 1\n", encoding="utf-8")
    refused(pendulab("fit", swing(tmp_path / "s.csv"), "--scene", scene), 2, "mass_k", "mass_kg")
    refused(pendulab("simulate", scene, "--out", tmp_path / "x.csv"), 2, "mass_k")


def test_simulate_writes_the_promised_columns(tmp_path):
    scene = tmp_path / "scene.toml"
    scene.write_text("[pendulum]\nmass_kg = 0.25\nlength_m = 0.5\n[release]\ntheta0_rad = 1.0\n", encoding="utf-8")
    done = pendulab("simulate", scene, "--out", tmp_path / "out.csv", "--duration-s", 10, "--rate-hz", 10)
    assert done.returncode == 0, done.stderr
    table = pd.read_csv(tmp_path / "out.csv")
    assert list(table.columns) == ["t_s", "theta_rad", "omega_rad_per_s", "tension_n", "energy_j"]
    # an independent DOP853 solution at rtol 1e-13
    assert table.theta_rad.iloc[100] == pytest.approx(-0.777341380923, abs=2e-9)


def test_convert_and_the_lists(tmp_path):
    series = swing(tmp_path / "swing.csv")
    assert pendulab("convert", series, tmp_path / "swing.txt").returncode == 0
    for listing, word in [("effects", "linear_drag"), ("models", "full_linear_drag"), ("trackers", "disc")]:
        done = pendulab(listing)
        assert done.returncode == 0
        assert word in done.stdout


def test_batch_makes_one_report_a_recording_and_goes_on_past_a_bad_one(tmp_path):
    folder = tmp_path / "class"
    folder.mkdir()
    swing(folder / "ann.csv")
    swing(folder / "bee.csv", seconds=15)
    (folder / "cat.csv").write_text("nothing here", encoding="utf-8")
    done = pendulab("batch", folder, "--out", tmp_path / "out", "--format", "html")
    assert done.returncode == 0, done.stderr
    table = pd.read_csv(tmp_path / "out" / "summary.csv")
    assert dict(zip(table.recording, table.done, strict=True)) == {"ann.csv": True, "bee.csv": True, "cat.csv": False}
    page = (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
    assert "ann/report.html" in page
    assert (tmp_path / "out" / "ann" / "report.html").is_file()
    refused(pendulab("batch", tmp_path / "nowhere", "--out", tmp_path / "o"), 1, "nowhere")


def test_version_and_bare_command():
    version = pendulab("--version")
    assert version.returncode == 0
    assert re.fullmatch(r"pendulab \d+\.\d+\S*\n", version.stdout)
    bare = pendulab()
    assert bare.returncode == 0
    assert bare.stdout == pendulab("--help").stdout


def test_help_of_every_command():
    listing = pendulab("--help")
    assert listing.returncode == 0
    assert "..." not in listing.stdout.partition("Commands:")[2]  # every line whole on 80 columns
    for command in [
        "demo",
        "track",
        "fit",
        "report",
        "simulate",
        "render",
        "cost",
        "paper",
        "batch",
        "convert",
        "effects",
        "models",
        "trackers",
    ]:
        assert command in listing.stdout
        assert pendulab(command, "--help").returncode == 0


def test_an_interrupt_that_a_library_swallows_is_raised_at_the_next_step():
    import cli

    step = cli._unless_interrupted(lambda stage, fraction: None)
    step("tracking", 0.1)
    try:
        with contextlib.suppress(KeyboardInterrupt):  # the library
            cli._interrupt()
        with pytest.raises(KeyboardInterrupt):
            step("tracking", 0.2)
    finally:
        cli._interrupted.clear()


@pytest.mark.skipif(os.name == "nt", reason="POSIX signals")
def test_stopping_leaves_nothing_behind(tmp_path):
    import signal
    import time

    clip = ROOT / "data" / "samples" / "pendulum.mp4"
    command = [sys.executable, str(ROOT / "cli.py"), "report", str(clip), "--out", str(tmp_path / "out")]
    running = subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True, encoding="utf-8")
    while not (tmp_path / "out").exists():
        assert running.poll() is None
        time.sleep(0.02)
    running.send_signal(signal.SIGINT)
    _, said = running.communicate(timeout=120)
    assert running.returncode == 130
    assert said.splitlines()[-1].startswith("pendulab: stopped")
    assert "Traceback" not in said
    assert not (tmp_path / "out").exists()


def test_a_stop_that_falls_into_a_finaliser_is_kept_and_not_printed(monkeypatch, capsys):
    from threading import Event

    import cli

    class Dying:
        def __init__(self, last: object):
            self.last = last

        def __del__(self):
            self.last()

    monkeypatch.setattr(sys, "unraisablehook", cli._unraisable)
    monkeypatch.setattr(cli, "_interrupted", Event())
    Dying(cli._interrupt)
    assert capsys.readouterr().err == ""
    with pytest.raises(KeyboardInterrupt):
        cli._unless_interrupted(lambda stage, fraction: None)("track", 0.5)

    def fails() -> None:
        raise ValueError("something else")

    Dying(fails)
    assert "something else" in capsys.readouterr().err  # what is no Ctrl-C is told as ever


def test_the_terminal_speaks_the_reports_language_and_tells_a_wrong_length(tmp_path):
    series = swing(tmp_path / "swing.csv")
    thai = pendulab("report", series, "--length-m", "0.3", "--lang", "th", "--format", "md", "--out", tmp_path / "th")
    assert thai.returncode == 0, thai.stderr
    assert "หมายเหตุ: ความยาวที่ให้มา" in thai.stdout
    english = pendulab("fit", series, "--length-m", "0.3", "--out", tmp_path / "en")
    assert "note: The length given, 0.3 m, contradicts the period" in english.stdout
