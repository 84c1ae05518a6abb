"""A class at once: films and tables, a broken one among them, one page in the class's language."""

from __future__ import annotations

from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from toolkit import JobError
from toolkit.batch import analyse_folder
from toolkit.render import render
from toolkit.scene import Scene

SCENE = """
[pendulum]
mass_kg = 0.05
length_m = 0.4
bob_radius_m = 0.02
[release]
theta0_rad = {theta0}
[effects.linear_drag]
k_d_kg_per_s = 2e-3
[camera]
width_px = 320
height_px = 240
fps = 60
duration_s = 4
px_per_m = 420
pivot_px = [160, 20]
"""


class Links(HTMLParser):
    """Where a page leads, and its words."""

    def __init__(self):
        super().__init__()
        self.links, self.text = [], []

    def handle_starttag(self, tag, attributes):
        self.links += [value for name, value in attributes if name == "href"]

    def handle_data(self, data):
        self.text.append(data)


@pytest.fixture(scope="module")
def class_folder(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("class")
    for name, theta0 in (("ann", 0.5), ("bee", 0.35)):
        (folder / f"{name}.toml").write_text(SCENE.format(theta0=theta0), encoding="utf-8")
        scene = Scene.from_toml(folder / f"{name}.toml")
        render(scene, folder / f"{name}.mp4")
    whole = (folder / "ann.mp4").read_bytes()
    (folder / "cat.mp4").write_bytes(whole[: len(whole) // 3])
    return folder


def test_films_with_a_broken_one(class_folder, tmp_path):
    rows = analyse_folder(class_folder, tmp_path / "out", lang="th", formats=("html",), jobs=1)
    assert {row.recording: row.done for row in rows} == {"ann.mp4": True, "bee.mp4": True, "cat.mp4": False}
    (broken,) = [row for row in rows if not row.done]
    assert "cat.mp4" in broken.sentence
    assert "unexpected" not in broken.sentence
    table = pd.read_csv(tmp_path / "out" / "summary.csv").set_index("recording")
    for name in ("ann.mp4", "bee.mp4"):
        assert abs(table["k_d [kg/s]"][name] - 2e-3) < 4 * table["u(k_d [kg/s])"][name] + 2e-5
    page = Links()
    page.feed((tmp_path / "out" / "index.html").read_text(encoding="utf-8"))
    for link in page.links:
        assert link == "data:," or (tmp_path / "out" / link).is_file()
    words = " ".join(page.text)
    assert "วิเคราะห์ได้ 2 จาก 3 ไฟล์" in words
    assert "kg/s" in words


def test_a_class_in_its_own_order_with_what_to_read_with_care(tmp_path):
    folder = tmp_path / "class"
    folder.mkdir()
    t = np.arange(0, 12, 1 / 30)
    theta = 0.1 * np.exp(-0.02 * t) * np.cos(4.4 * t) + np.random.default_rng(3).normal(0, 1e-3, t.size)
    rows = [f"{a:.9g},{b:.9g}" for a, b in zip(t, theta, strict=True)]
    for name in ("Group 2.csv", "group 10.csv", "group 1.csv"):
        header = "time,theta_rad" if name == "group 10.csv" else "t_s,theta_rad"  # no unit of time: assumed, and told
        (folder / name).write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    told = analyse_folder(folder, tmp_path / "out", formats=("html",), jobs=1)
    assert [row.recording for row in told] == ["group 1.csv", "Group 2.csv", "group 10.csv"]
    assert [any("seconds were assumed" in line for line in row.cautions) for row in told] == [False, False, True]
    page = (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
    assert page.count("seconds were assumed") == 1
    table = pd.read_csv(tmp_path / "out" / "summary.csv", dtype={"points": str}).set_index("recording")
    assert "seconds were assumed" in table["read_with_care"]["group 10.csv"]
    assert table["points"]["group 1.csv"] == "360"


def test_a_folder_without_a_recording(tmp_path):
    with pytest.raises(JobError, match="holds no video"):
        analyse_folder(tmp_path, tmp_path / "out")
