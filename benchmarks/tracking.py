"""How well tracking does, on films with exact truth.

    python benchmarks/tracking.py accuracy            the conditions of the accuracy list, 720p, beside the Cramér–Rao bound
    python benchmarks/tracking.py speed [VIDEO]       search, localiser, whole tracking beside decoding alone, by the clock and in CPU time
    python benchmarks/tracking.py memory [VIDEO]      the most memory that tracking 3 minutes of 1080p takes
    python benchmarks/tracking.py scenes [--count 200] [--first 0] [--jobs 1] [--keep FOLDER]
                                                      random scenes over all camera effects: locked, silent failures, σ

Every scene is random by its number alone, so a failure is named by a number. A clip is
- locked: a track came out, 95 % of the frames on which the bob is wholly visible (repeated pictures aside) are ok, rms error per axis below 1 px;
- wrong: the rms error of ok frames is over 1 px, or θ is off by more than 5 σ of what calibration.json states: the
  zero (against vertical_sigma_rad), the scale (against angle_scale_relative_u) or the rest (against the σ of each frame),
  all at the times that theta.csv states (where the shutter rolls, but for a constant: which row a stamp belongs to is unknown);
- a silent failure: wrong, and neither refused nor accompanied by any warning;
- misled: wrong in something that none of its warnings is about (`ABOUT` lists which is about what).
"""

from __future__ import annotations

import argparse
import csv
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, fields
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from toolkit import JobError, Scene, calibrate, render, track
from toolkit.camera import effect_names
from toolkit.cost.tracking import cramer_rao_px
from toolkit.render import stage

# Which warnings (by the key of their sentence) are about which error.
ABOUT: dict[str, frozenset[str]] = {
    "position": frozenset(
        {
            "track.strays",
            "track.few",
            "track.poor_picture",
            "track.apart",
            "track.never_both",
            "track.rival",
            "calibrate.beside",
        }
    ),
    "zero": frozenset(
        {"track.strays", "track.apart", "track.rival", "calibrate.wide", "calibrate.odd_view", "track.grows"}
    ),
    "scale": frozenset({"track.strays", "track.apart", "track.rival", "calibrate.wide", "calibrate.odd_view"}),
    "rest": frozenset(
        {"track.strays", "calibrate.odd_view", "track.grows", "track.clock_slips", "track.leaps", "video.backwards"}
    ),
}


@dataclass(frozen=True)
class Outcome:
    """What became of one clip. Errors are rms px per axis over ok frames; std_* are of error/σ after the mean is removed."""

    name: str
    refused: str = ""
    visible_frames: int = 0
    ok_fraction: float = 0.0
    hidden_ok: int = 0  # frames marked ok though less than half of the bob is visible
    rms_x_px: float = float("nan")
    rms_y_px: float = float("nan")
    spread_x_px: float = float("nan")
    spread_y_px: float = float("nan")
    bound_x_px: float = float("nan")
    bound_y_px: float = float("nan")
    std_x: float = float("nan")
    std_y: float = float("nan")
    pivot_error_px: float = float("nan")
    theta_rms_deg: float = float("nan")
    zero_sigmas: float = float("nan")
    scale_sigmas: float = float("nan")
    rest_sigmas: float = float("nan")
    scale_error: float = float("nan")
    localiser: str = ""
    warnings: str = ""
    told: str = ""  # the keys of the warnings
    cpu_s: float = 0.0
    frames: int = 0

    @property
    def locked(self) -> bool:
        return not self.refused and self.ok_fraction >= 0.95 and max(self.rms_x_px, self.rms_y_px) <= 1

    @property
    def wrong_in(self) -> tuple[str, ...]:
        """What is wrong: position, zero, scale, rest."""
        if self.refused:
            return ()
        far = {
            "position": max(self.rms_x_px, self.rms_y_px) > 1,
            "zero": self.zero_sigmas > 5,
            "scale": self.scale_sigmas > 5,
            "rest": self.rest_sigmas > 5,
        }
        return tuple(name for name, wrong in far.items() if wrong)

    @property
    def wrong(self) -> bool:
        return bool(self.wrong_in)

    @property
    def silent_failure(self) -> bool:
        return self.wrong and not self.warnings

    @property
    def misled(self) -> bool:
        """Something is wrong that no warning is about."""
        return any(not ABOUT[name] & set(self.told.split()) for name in self.wrong_in)


def measure(scene: Scene, video: Path, name: str = "") -> Outcome:
    """Track and calibrate a rendered video and compare it with the truth of its scene."""
    studio = stage(scene)
    truth = studio.truth
    began = time.process_time()
    try:
        found = track(video)
        series = calibrate(found)
    except JobError as refusal:
        return Outcome(name, refused=str(refusal), frames=truth.frame.size, cpu_s=time.process_time() - began)
    cpu = time.process_time() - began
    if not found.ok.any():
        return Outcome(name, refused="no frame is ok", frames=truth.frame.size, cpu_s=cpu)
    row = np.searchsorted(truth.frame, found.frame)
    anew = np.concatenate([[True], np.diff(truth.t_s[row]) > 0])  # a repeated picture shows nothing of its own time
    ok, seen = found.ok, (truth.visible[row] > 0.995) & anew
    dx, dy = found.x_px - truth.x_px[row], found.y_px - truth.y_px[row]
    nx, ny = (dx / found.sigma_x_px)[ok], (dy / found.sigma_y_px)[ok]
    rolls = scene.camera is not None and "rolling_shutter" in scene.camera.effects
    used = row[ok] if ok.sum() == len(series) else row[np.isin(found.t_s, series.t_s)]
    late = series.t_s - (truth.t_s[used] - truth.stamp_s[row[0]])  # stated time less the true one
    path = truth.trajectory
    rate = np.interp(truth.t_s[used], path.t_s, path.omega_rad_per_s)
    if not rolls:
        late = np.zeros_like(
            late
        )  # what is wrong with stamps shows in the angles: they are judged at the film's own times
    theta = truth.theta_rad[used] + rate * late
    zero, scale, rest, scale_error = _theta_sigmas(series, theta, rate if rolls else None)
    bound = cramer_rao_px(studio)
    pivot = np.array(series.meta.get("calibration", {}).get("pivot_px", found.pivot_px))
    return Outcome(
        name=name,
        visible_frames=int(seen.sum()),
        ok_fraction=float(ok[seen].mean()) if seen.any() else 0.0,
        hidden_ok=int((ok & (truth.visible[row] < 0.5)).sum()),
        rms_x_px=float(np.sqrt(np.mean(dx[ok] ** 2))),
        rms_y_px=float(np.sqrt(np.mean(dy[ok] ** 2))),
        spread_x_px=float(np.std(dx[ok])),
        spread_y_px=float(np.std(dy[ok])),
        bound_x_px=bound[0],
        bound_y_px=bound[1],
        std_x=float(np.std(nx)),
        std_y=float(np.std(ny)),
        pivot_error_px=float(np.hypot(*(pivot - truth.pivot_px[0]))),
        theta_rms_deg=float(np.degrees(np.sqrt(np.mean((series.theta_rad - theta) ** 2)))),
        zero_sigmas=zero,
        scale_sigmas=scale,
        rest_sigmas=rest,
        scale_error=scale_error,
        localiser=found.localiser,
        warnings=" | ".join(series.meta.get("warnings", ())),
        told=" ".join(getattr(w, "key", "") for w in series.meta.get("warnings", ())),
        cpu_s=cpu,
        frames=truth.frame.size,
    )


def _theta_sigmas(series: Any, theta: np.ndarray, rate: np.ndarray | None = None) -> tuple[float, float, float, float]:
    """How many stated σ the zero, the scale and the rest of θ are off; and the scale's relative error. With a `rate` a
    constant shift of time is no error."""
    columns = [np.ones_like(theta), theta] + ([] if rate is None else [rate])
    design = np.stack(columns, axis=1)
    sigma = series.sigma_theta_rad
    (zero, factor, *shift), *_ = np.linalg.lstsq(design / sigma[:, None], series.theta_rad / sigma, rcond=None)
    covariance = np.linalg.inv((design / sigma[:, None]).T @ (design / sigma[:, None]))
    rest = series.theta_rad - design @ [zero, factor, *shift]
    u_zero = np.hypot(series.meta.get("vertical_sigma_rad") or 0.0, np.sqrt(covariance[0, 0]))
    u_scale = np.hypot(series.meta.get("angle_scale_relative_u") or 0.0, np.sqrt(covariance[1, 1]))
    return (
        float(abs(zero) / u_zero),
        float(abs(factor - 1) / u_scale),
        float(np.sqrt(np.mean((rest / sigma) ** 2))),
        float(factor - 1),
    )


# --- random scenes ---------------------------------------------------------------------------------------------------

Draw = Callable[[np.random.Generator, Mapping[str, Any]], dict[str, Any]]

# Ordinary strengths: what a student's film has on a bad day, not what no one could track. An effect that is not
# named here is used with its own example.
DRAWS: dict[str, Draw] = {
    "motion_blur": lambda r, c: {"exposure_s": r.uniform(0.1, 0.6) / c["fps"]},
    "rolling_shutter": lambda r, c: {"readout_s": r.uniform(0.2, 0.9) / c["fps"]},
    "sensor_noise": lambda r, c: {"read_sigma": r.uniform(1, 8), "shot_sigma_at_white": r.uniform(0, 10)},
    "gamma": lambda r, c: {"gamma": r.uniform(1.8, 2.4)},
    "lens_distortion": lambda r, c: {"k1": r.uniform(-0.1, 0.06)},
    "perspective": lambda r, c: {
        "yaw_rad": r.uniform(-0.3, 0.3),
        "pitch_rad": r.uniform(-0.15, 0.15),
        "roll_rad": r.uniform(-0.08, 0.08),
        "distance_m": r.uniform(1.2, 3.0),
    },
    "out_of_plane": lambda r, c: {
        "amplitude_rad": r.uniform(0.01, 0.12),
        "phase_rad": r.uniform(0, 6.28),
        "distance_m": r.uniform(1.2, 3.0),
    },
    "hand_shake": lambda r, c: {"rms_px": r.uniform(0.5, 4), "roll_rms_rad": r.uniform(0, 0.003)},
    "focus_blur": lambda r, c: {"sigma_px": r.uniform(0.5, 3)},
    "vignetting": lambda r, c: {"corner_loss": r.uniform(0.1, 0.5)},
    "lighting_drift": lambda r, c: {"relative": r.uniform(-0.4, 0.4), "wave": r.uniform(0, 0.1)},
    "flicker": lambda r, c: {"depth": r.uniform(0.02, 0.2), "f_hz": float(r.choice([100, 120]))},
    "texture": lambda r, c: {"rms": r.uniform(3, 18), "scale_px": r.uniform(10, 60)},
    "clutter": lambda r, c: {"count": float(r.integers(3, 16)), "contrast": r.uniform(40, 130)},
    "shadow": lambda r, c: {
        "strength": r.uniform(0.1, 0.5),
        "right_px": r.uniform(-30, 30),
        "down_px": r.uniform(0, 25),
        "softness_px": r.uniform(2, 8),
    },
    "string": lambda r, c: {"width_px": float(r.choice([0, 0.5, 1, 3, 5])), "colour_rgb": [r.uniform(20, 140)] * 3},
    "wall": lambda r, c: {"colour_rgb": list(r.uniform(120, 230, 3)), "gradient": r.uniform(-0.2, 0.2)},
    "bob_look": lambda r, c: {
        "look": str(r.choice(["shaded", "highlight", "rotating_pattern", "two_coloured"])),
        "colour_rgb": list(r.uniform(20, 110, 3)),
        "strength": r.uniform(0.3, 0.8),
        "spin_rad_per_s": r.uniform(-4, 4),
    },
    "occluding_post": lambda r, c: {
        "x_px": c["pivot_px"][0] + r.uniform(-0.6, 0.6) * c["reach_px"],
        "width_px": r.uniform(0.5, 3) * c["radius_px"],
    },
    "distractor": lambda r, c: {
        "shape": str(r.choice(["disc", "figure"])),
        "depth": str(r.choice(["behind", "front"])),
        "start_s": r.uniform(0, 2),
        "speed_px_per_s": r.choice([-1, 1]) * r.uniform(100, 400),
        "y_px": r.uniform(0.2, 0.8) * c["height_px"],
        "radius_px": r.uniform(0.7, 2) * c["radius_px"],
    },
    "support": lambda r, c: {"size_px": r.uniform(15, 40)},
    "dropped_frames": lambda r, c: {"fraction": r.uniform(0.02, 0.2), "stamps": str(r.choice(["true", "counted"], p=[0.8, 0.2]))},
    "duplicated_frames": lambda r, c: {"fraction": r.uniform(0.02, 0.15)},
    "variable_frame_rate": lambda r, c: {"jitter_s": r.uniform(0.05, 0.3) / c["fps"]},
    "codec": lambda r, c: {
        "name": str(r.choice(["h264", "hevc", "mjpeg", "lossless"], p=[0.4, 0.15, 0.25, 0.2])),
        "bit_rate_bit_per_s": r.uniform(0.6e6, 6e6),
    },
}  # fmt: skip


def random_scene(number: int) -> tuple[Scene, tuple[str, ...]]:
    """Scene `number` and the camera effects on it: one in turn, and each other with a chance of 1 in 10."""
    r = np.random.default_rng([2026, number])
    names = effect_names()
    width, height = [(640, 480), (640, 360), (480, 640), (960, 540)][r.integers(4)]
    length_m = r.uniform(0.25, 1.0)
    amplitude = np.radians(r.choice([r.uniform(3, 8), r.uniform(8, 30), r.uniform(30, 70)]))
    radius = r.uniform(8, 22)
    floor, side = height - radius - 12, width / 2 - radius - 12
    reach = min(side / np.sin(min(amplitude, np.pi / 2)), height * r.uniform(0.7, 1.6))  # pivot to bob, px
    pivot = (width / 2 + r.uniform(-8, 8), min(floor - reach, height * 0.5))
    wall = r.uniform(150, 225) + r.uniform(-15, 15, 3)
    bob = np.clip(wall - r.uniform(70, 150) + r.uniform(-25, 25, 3), 8, 247)
    fps = float(r.choice([29.97, 30, 60, 59.94]))
    camera: dict[str, Any] = {
        "width_px": width, "height_px": height, "fps": fps, "duration_s": 4.0, "px_per_m": reach / length_m,
        "pivot_px": list(pivot), "seed": number,
    }  # fmt: skip
    known = {**camera, "radius_px": radius, "reach_px": reach * np.sin(amplitude)}
    used = {names[number % len(names)]} | {name for name in names if r.random() < 0.1}
    camera["wall"] = {"colour_rgb": list(wall)}
    camera["bob_look"] = {"colour_rgb": list(bob)}
    camera["sensor_noise"] = {"read_sigma": r.uniform(1, 3)}
    camera["codec"] = {"name": "h264", "bit_rate_bit_per_s": r.uniform(1.5e6, 6e6)}
    for name in sorted(used):
        values = DRAWS[name](np.random.default_rng([number, len(name), ord(name[0])]), known) if name in DRAWS else {}
        camera[name] = {**camera.get(name, {}), **values}
    if {"variable_frame_rate", "dropped_frames"} & used and camera["codec"]["name"] == "mjpeg":
        camera["codec"]["name"] = "h264"
    table = {
        "pendulum": {"mass_kg": 0.05, "length_m": length_m, "bob_radius_m": radius * length_m / reach},
        "release": {"theta0_rad": float(amplitude), "omega0_rad_per_s": 0.0},
        "effects": {
            "linear_drag": {"k_d_kg_per_s": r.uniform(0, 4e-3)},
            "quadratic_drag": {"c_kg_per_m": r.uniform(0, 2e-3)},
        },
        "camera": camera,
    }
    return Scene.from_dict(_plain(table)), tuple(sorted(used))


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {k: _plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    return value.item() if isinstance(value, np.generic) else value


def run_scene(number: int, folder: Path) -> Outcome:
    """Render random scene `number` into `folder` (unless it is there) and measure it."""
    scene, used = random_scene(number)
    film = folder / f"scene{number:04d}.mkv"
    if not film.exists():
        render(scene, film)
    return measure(scene, film, f"{number} {'+'.join(used)}")


def _scene_alone(number: int, folder: Path, keep: bool) -> Outcome:
    """`run_scene`, its clip removed unless it is to be kept."""
    outcome = run_scene(number, folder)
    if not keep:
        (folder / f"scene{number:04d}.mkv").unlink()
    return outcome


def _each(numbers: Iterable[int], folder: Path, asked: argparse.Namespace) -> Iterator[Outcome]:
    """The outcomes in order, from as many processes as asked for."""
    keep = asked.keep is not None
    if asked.jobs == 1:
        yield from (_scene_alone(n, folder, keep) for n in numbers)
        return
    with ProcessPoolExecutor(asked.jobs) as pool:
        yield from pool.map(partial(_scene_alone, folder=folder, keep=keep), numbers)


# --- the accuracy list -----------------------------------------------------------------------------------------------


def accuracy_scenes() -> dict[str, tuple[dict[str, Any], dict[str, Any], float | None]]:
    """Name -> (camera effects, other changes, limit in px per axis; a limit None is 1.3 times the bound)."""
    plain: dict[str, Any] = {"sensor_noise": {"read_sigma": 2.0}, "string": {"width_px": 2}}
    mbit8 = {"codec": {"name": "h264", "bit_rate_bit_per_s": 8e6, "effort": "thorough"}}
    return {
        "clean, lossless, no string": ({**plain, "string": {"width_px": 0}, "codec": {"name": "lossless"}}, {}, None),
        "clean, lossless": ({**plain, "codec": {"name": "lossless"}}, {}, None),
        "H.264 8 Mbit/s": ({**plain, **mbit8}, {}, 0.02),
        "half-frame blur": ({**plain, **mbit8, "motion_blur": {"exposure_s": 0.5 / 60}}, {}, 0.035),
        "low light": (
            {**mbit8, "string": {"width_px": 2}, "wall": {"colour_rgb": [60, 60, 60]},
             "bob_look": {"colour_rgb": [15, 15, 15]}, "sensor_noise": {"read_sigma": 6, "shot_sigma_at_white": 12}}, {}, 0.09),
        "low contrast": ({**plain, **mbit8, "bob_look": {"colour_rgb": [175, 175, 175]}}, {}, 0.06),
        "textured wall": ({**plain, **mbit8, "texture": {"rms": 10, "scale_px": 24}}, {}, 0.03),
        "rotating pattern": (
            {**plain, **mbit8, "bob_look": {"look": "rotating_pattern", "colour_rgb": [40, 60, 120], "strength": 0.5}}, {}, 0.12),
        "highlight (spread)": (
            {**plain, **mbit8, "bob_look": {"look": "highlight", "colour_rgb": [60, 50, 45], "strength": 0.8}}, {}, 0.05),
        "3 degrees (pivot 0.5 px)": ({**plain, **mbit8}, {"theta0_rad": 0.0524}, 0.02),
    }  # fmt: skip


def accuracy_scene(effects: Mapping[str, Any], changes: Mapping[str, Any], duration_s: float = 6.0) -> Scene:
    """A 720p pendulum, R = 20 px, 20 degrees, with these camera effects."""
    camera = {"width_px": 1280, "height_px": 720, "fps": 60, "duration_s": duration_s, "px_per_m": 1000,
              "pivot_px": [641.3, 60.4], "seed": 7}  # fmt: skip
    return Scene.from_dict(
        {
            "pendulum": {"mass_kg": 0.1, "length_m": 0.55, "bob_radius_m": 0.02},
            "release": {"theta0_rad": changes.get("theta0_rad", 0.35)},
            "effects": {"linear_drag": {"k_d_kg_per_s": 1e-3}},
            "camera": {**camera, **effects},
        }
    )


def run_accuracy(folder: Path) -> list[tuple[Outcome, float]]:
    """Every condition of the accuracy list, with its limit in px."""
    done = []
    for name, (effects, changes, limit) in accuracy_scenes().items():
        scene = accuracy_scene(effects, changes)
        film = folder / f"{name.split(',')[0].replace('/', '').replace(' ', '_')}{len(done)}.mkv"
        if not film.exists():
            render(scene, film)
        outcome = measure(scene, film, name)
        done.append((outcome, limit or 1.3 * max(outcome.bound_x_px, outcome.bound_y_px)))
        _print_accuracy(*done[-1])
    return done


def _print_accuracy(o: Outcome, limit: float) -> None:
    if o.refused:
        print(f"{o.name:28s} REFUSED {o.refused}", flush=True)
        return
    x, y = (o.spread_x_px, o.spread_y_px) if "spread" in o.name else (o.rms_x_px, o.rms_y_px)
    print(
        f"{o.name:28s} {x:8.4f} {y:8.4f}  limit {limit:.4f} {'ok  ' if max(x, y) <= limit else 'OVER'}"
        f"  bound {o.bound_x_px:.4f} {o.bound_y_px:.4f}  error/σ {o.std_x:.2f} {o.std_y:.2f}  ok {o.ok_fraction:.1%}"
        f"  pivot {o.pivot_error_px:.2f} px  θ {o.theta_rms_deg:.4f}°  {o.localiser}  {o.warnings[:60]}",
        flush=True,
    )


# --- speed -----------------------------------------------------------------------------------------------------------


_LARGE = {"width_px": 1920, "height_px": 1080, "px_per_m": 1500, "pivot_px": [961.9, 90.6]}


def speed_films(folder: Path) -> list[Path]:
    """Films of 10 s of the accuracy list's pendulum: 720p and 1080p in H.264, and 720p in HEVC."""
    kinds: tuple[tuple[str, str, dict[str, Any]], ...] = (
        ("720p", "h264", {}),
        ("1080p", "h264", _LARGE),
        ("720p", "hevc", {}),
    )
    return [_film(folder / f"speed_{name}_{codec}.mp4", codec, changes, 10.0) for name, codec, changes in kinds]


def long_film(folder: Path) -> Path:
    """The same pendulum for 3 minutes: 1080p, 30 frames a second."""
    return _film(folder / "long_1080p_h264.mp4", "h264", {**_LARGE, "fps": 30}, 180.0)


def _film(film: Path, codec: str, changes: Mapping[str, Any], duration_s: float) -> Path:
    """Rendered unless it is there."""
    if not film.exists():
        rate = 12e6 if changes else 8e6
        effects = {"sensor_noise": {"read_sigma": 2.0}, "codec": {"name": codec, "bit_rate_bit_per_s": rate}}
        render(accuracy_scene({**effects, **changes}, {}, duration_s), film)
    return film


def decode_by_pyav(video: Path) -> None:
    """Every frame decoded by PyAV with frame threads, as it comes, and nothing done with it."""
    import av

    with av.open(str(video)) as container:
        stream = container.streams.video[0]
        stream.thread_type = "AUTO"
        for _ in container.decode(stream):
            pass


def run_speed(video: Path, repeats: int = 7) -> None:
    """Search, localiser a frame and whole tracking beside decoding alone.

    Decoding alone is PyAV's with frame threads as they come, and that of our own reader, which has one thread to a processor.
    The time that passes is what a user waits for; CPU time is the sum over all processors. All are the least of `repeats`
    runs, in turn.
    """
    from toolkit.trackers import load_tracker
    from toolkit.tracking.begin.acquire import find_clear_bob
    from toolkit.tracking.opening import Asked, begin, openings, read_ahead
    from toolkit.video import open_video

    def timed(job: Callable[[], Any]) -> np.ndarray:
        began = time.perf_counter(), time.process_time()
        job()
        return np.array([time.perf_counter() - began[0], time.process_time() - began[1]])

    def cpu(job: Callable[[], Any]) -> float:
        return float(min(timed(job)[1] for _ in range(repeats)))

    found = track(video)  # whatever is compiled is compiled
    frames = found.frame.size
    jobs: dict[str, Callable[[], Any]] = {
        "PyAV's decoding alone": lambda: decode_by_pyav(video),
        "our reader's alone": lambda: sum(1 for _ in open_video(video)),
        "same, B pictures unfiltered": lambda: sum(1 for _ in open_video(video, filtered=False)),
        "whole tracking": lambda: track(video),
    }
    runs = [[timed(job) for job in jobs.values()] for _ in range(repeats)]
    spent = dict(zip(jobs, np.min(runs, axis=0) / frames * 1e6))
    whole = spent.pop("whole tracking")
    opening = openings(open_video(video))[0]
    batch = read_ahead(iter(open_video(video)), opening)
    search = cpu(lambda: find_clear_bob(batch, None, None))
    begun = begin(open_video(video), Asked(), opening)
    assert begun is not None
    follower = begun[0]
    frame = batch[len(batch) // 2]
    x, y, vx, vy = follower._expect(frame.t_s)
    guess = follower._guess(x, y, vx, vy, follower.exposure_s)
    patch = follower._patch(frame, follower.look, guess)
    assert patch is not None
    locate = load_tracker("disc").locate
    fit = cpu(lambda: [locate(patch, follower.look, guess) for _ in range(2000)])
    beginning = cpu(lambda: begin(open_video(video), Asked(), opening))
    print(
        f"{video.name}: {found.meta['width_px']}x{found.meta['height_px']}, {frames} frames, ok {found.ok.mean():.1%}"
    )
    print(f"  search for the bob        {search:.3f} s CPU ({len(batch)} frames in memory; limit 0.3)")
    print(f"  search and looks learned  {beginning:.3f} s CPU (decoding of these frames included)")
    print(f"  localiser                 {fit / 2000 * 1e6:.0f} us a frame (limit 50 at 720p)")
    print(f"  whole tracking            {whole[0]:.0f} us a frame passing, {whole[1]:.0f} us CPU")
    for name, alone in spent.items():
        passing, used = alone / whole
        print(
            f"  {name:28s}{alone[0]:.0f} us passing, {alone[1]:.0f} us CPU: tracking at {passing:.2f} of its rate, "
            f"{used:.2f} in CPU time"
        )
    print("  limit: 0.90 of the rate of decoding alone")


def run_memory(video: Path) -> None:
    """The most memory that tracking a film takes, in a process of its own."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as alone:
        frames, peak_mb = alone.submit(_peak_memory, video).result()
    print(f"{video.name}: {frames} frames, {peak_mb:.0f} MB at most (limit 600 for 3 min of 1080p)")


def _peak_memory(video: Path) -> tuple[int, float]:
    """How many frames a film has, and the most memory (MB) of this process after tracking it."""
    import resource  # not on Windows

    frames = track(video).frame.size
    unit = 2**20 if sys.platform == "darwin" else 2**10
    return frames, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / unit


# --- summary ---------------------------------------------------------------------------------------------------------


def summarise(outcomes: list[Outcome]) -> str:
    """The numbers that count, and every clip that did not lock or failed silently."""
    locked = [o for o in outcomes if o.locked]
    silent = [o for o in outcomes if o.silent_failure]
    lines = [
        f"scenes                    {len(outcomes)}",
        f"locked                    {len(locked)} ({len(locked) / len(outcomes):.1%})",
        f"refused (exit 1)          {sum(bool(o.refused) for o in outcomes)}",
        f"SILENT FAILURES           {len(silent)}",
        f"wrong, warned of it       {sum(o.wrong and not o.misled for o in outcomes)}",
        f"wrong, warned of another  {sum(o.misled and bool(o.warnings) for o in outcomes)}",
        f"right, with a warning     {sum(o.locked and not o.wrong and bool(o.warnings) for o in outcomes)}"
        f" of {sum(o.locked and not o.wrong for o in outcomes)}",
        f"hidden frames called ok   {sum(o.hidden_ok for o in outcomes)}",
    ]
    if locked:
        spread = [np.median([getattr(o, f) for o in locked]) for f in ("std_x", "std_y")]
        inside = np.mean([0.9 <= s <= 1.1 for o in locked for s in (o.std_x, o.std_y)])
        lines.append(
            f"std of error/σ            median {spread[0]:.2f}, {spread[1]:.2f}; within 0.9 to 1.1: {inside:.0%}"
        )
        rms = [np.median([getattr(o, f) for o in locked]) for f in ("rms_x_px", "rms_y_px")]
        lines.append(f"rms per axis, median      {rms[0]:.4f}, {rms[1]:.4f} px")
    lines += ["", "by effect                  clips locked silent  median rms px   bound    error/σ"]
    for effect in effect_names():
        group = [o for o in outcomes if effect in o.name.split(" ", 1)[1].split("+")]
        good = [o for o in group if o.locked]
        if group:
            values = [np.median([getattr(o, f) for o in good]) if good else np.nan for f in
                      ("rms_x_px", "rms_y_px", "bound_x_px", "std_x", "std_y")]  # fmt: skip
            lines.append(
                f"  {effect:24s} {len(group):5d} {len(good):6d} {sum(o.silent_failure for o in group):6d}"
                f"  {values[0]:7.4f} {values[1]:7.4f} {values[2]:7.4f}  {values[3]:5.2f} {values[4]:5.2f}"
            )
    lines += ["", "not locked, or wrong:", *(describe(o) for o in outcomes if not o.locked or o.wrong)]
    return "\n".join(lines)


def describe(o: Outcome) -> str:
    """One line on a clip."""
    if o.refused:
        return f"  {o.name}: refused: {o.refused}"
    return (
        f"  {o.name}: {'SILENT ' if o.silent_failure else 'MISLED ' if o.misled else ''}ok {o.ok_fraction:.0%}, rms {o.rms_x_px:.3f} {o.rms_y_px:.3f} px, "
        f"pivot off {o.pivot_error_px:.1f} px, θ rms {o.theta_rms_deg:.3f}°, zero {o.zero_sigmas:.1f}σ, scale {o.scale_sigmas:.1f}σ "
        f"({o.scale_error:+.2%}), rest {o.rest_sigmas:.1f}σ, error/σ {o.std_x:.2f} {o.std_y:.2f}, {o.localiser}, warnings: {o.warnings[:160] or 'none'}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("what", choices=["accuracy", "memory", "scenes", "speed"])
    parser.add_argument("video", type=Path, nargs="?", help="for speed and memory; by default clips are rendered")
    parser.add_argument("--count", type=int, default=8 * len(effect_names()))
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1, help="processes for scenes")
    parser.add_argument("--numbers", type=int, nargs="*", help="these scenes only")
    parser.add_argument("--keep", type=Path, help="folder of rendered clips, used again where they exist")
    parser.add_argument("--table", type=Path, help="write one row a clip to this CSV")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = asked.keep or Path(scratch)
        folder.mkdir(parents=True, exist_ok=True)
        if asked.what == "speed":
            for film in [asked.video] if asked.video else speed_films(folder):
                run_speed(film)
            return
        if asked.what == "memory":
            run_memory(asked.video or long_film(folder))
            return
        if asked.what == "accuracy":
            outcomes = [outcome for outcome, _ in run_accuracy(folder)]
        else:
            outcomes = []
            for outcome in _each(asked.numbers or range(asked.first, asked.first + asked.count), folder, asked):
                outcomes.append(outcome)
                print(describe(outcome), flush=True)
            print(summarise(outcomes))
    if asked.table:
        with asked.table.open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, [f.name for f in fields(Outcome)])
            writer.writeheader()
            writer.writerows(asdict(o) for o in outcomes)


if __name__ == "__main__":
    main()
