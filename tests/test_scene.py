"""Scenes: what is read is what was written, and what is wrong is named."""

from __future__ import annotations

import pytest

from toolkit import JobError, Scene, UsageError
from toolkit.scene import Camera, normal_gravity

SCENE = """
[pendulum]
mass_kg = 0.25
length_m = 0.5
bob_radius_m = 0.02
[release]
theta0_rad = 0.6
[environment]
latitude_deg = 13.7563
[effects.linear_drag]
k_d_kg_per_s = 0.16
[effects.cosine_drive]
f0_n = 0.15
f_hz = 0.15
[approximations]
small_angle = true
[camera]
width_px = 640
pivot_px = [320, 40]
[camera.motion_blur]
exposure_s = 0.004
"""


def test_round_trip(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(SCENE, encoding="utf-8")
    scene = Scene.from_toml(path)
    assert scene.pendulum.mass_kg == 0.25
    assert scene.effects["linear_drag"]["k_d_kg_per_s"] == 0.16
    assert scene.camera.pivot_px == (320.0, 40.0)
    assert scene.camera.effects["motion_blur"]["exposure_s"] == 0.004
    assert Scene.from_dict(scene.to_dict()) == scene


# latitude, height, g as tabulated from the WGS84 formula
@pytest.mark.parametrize(
    ("latitude_deg", "height_m", "g"),
    [(0, 0, 9.780325), (13.7563, 0, 9.783246), (45, 0, 9.806198), (90, 0, 9.832185), (45, 1000, 9.803113)],
)
def test_normal_gravity(latitude_deg, height_m, g):
    assert normal_gravity(latitude_deg, height_m) == pytest.approx(g, abs=6e-7)


def test_gravity_defaults_to_the_standard_value():
    assert Scene().environment.gravity_m_per_s2 == 9.80665


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"pendulum": {"mas_kg": 1}}, ["mas_kg", "mass_kg"]),
        ({"pendulun": {}}, ["pendulun", "pendulum"]),
        ({"pendulum": {"mass_kg": -1}}, ["mass_kg", "positive", "-1"]),
        ({"pendulum": {"mass_kg": "heavy"}}, ["mass_kg", "heavy"]),
        ({"pendulum": {"mass_kg": float("nan")}}, ["mass_kg", "nan"]),
        ({"pendulum": {"mass_kg": True}}, ["mass_kg", "True"]),
        ({"pendulum": 3}, ["pendulum", "3"]),
        ({"effects": {"linear_drg": {}}}, ["linear_drg", "linear_drag"]),
        ({"effects": {"linear_drag": {"k_d": 1}}}, ["k_d", "k_d_kg_per_s"]),
        ({"effects": {"linear_drag": {}}}, ["linear_drag", "k_d_kg_per_s"]),
        ({"effects": {"linear_drag": {"k_d_kg_per_s": -0.1}}}, ["k_d_kg_per_s", "-0.1"]),
        ({"effects": 1}, ["effects"]),
        ({"camera": {"pivot_px": [1]}}, ["pivot_px"]),
        ({"camera": {"width_px": 64.5}}, ["width_px", "64.5"]),
        ({"camera": {"motion_blurr": {}}}, ["motion_blurr", "motion_blur"]),
        ({"environment": {"g_m_per_s2": 9.8, "latitude_deg": 10}}, ["g_m_per_s2", "latitude_deg"]),
        ({"approximations": {"small_angle": "yes"}}, ["small_angle", "yes"]),
    ],
)
def test_a_wrong_scene_is_refused_with_its_key_named(table, words):
    with pytest.raises(UsageError) as caught:
        Scene.from_dict(table)
    for word in words:
        assert word in str(caught.value)
    assert "\n" not in str(caught.value)


def test_unreadable_files(tmp_path):
    with pytest.raises(JobError, match=r"nothing\.toml"):
        Scene.from_toml(tmp_path / "nothing.toml")
    broken = tmp_path / "broken.toml"
    broken.write_text("[pendulum\nmass", encoding="utf-8")
    with pytest.raises(UsageError, match="TOML"):
        Scene.from_toml(broken)
    binary = tmp_path / "binary.toml"
    binary.write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(UsageError, match="UTF-8"):
        Scene.from_toml(binary)


def test_a_scene_made_in_python_is_checked_like_a_file():
    scene = Scene(effects={"moving_pivot": {"amplitude_m": 0.01, "f_hz": 2.0}})
    assert scene.effects["moving_pivot"]["phase_rad"] == 0.0
    with pytest.raises(UsageError, match="linear_drag"):
        Scene(effects={"linear_darg": {}})
    with pytest.raises(UsageError, match="k_d_kg_per_s"):
        Scene(effects={"linear_drag": {"k_d": 0.1}})
    with pytest.raises(UsageError, match="perspective"):
        Camera(effects={"perspectiv": {}})
