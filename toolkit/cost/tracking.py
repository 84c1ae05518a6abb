"""Tracking: error against time per frame, ours and public peers on the same frames, beside what is physically possible.

Clips of a plain pendulum are rendered here, with exact truth, at several resolutions and bit rates. Our trackers run as
a user runs them (decoding and the search for the bob included). Peers get the decoded frames in memory, the bob's first
position and radius, and a window about where it must be next: more help than a user has to give ours. Times are CPU times.
"""

from __future__ import annotations

import csv
import math
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from toolkit.cost._followers import PEERS, Prepare, localiser
from toolkit.errors import JobError
from toolkit.progress import Progress, silent
from toolkit.render import Studio, Truth, render, stage
from toolkit.scene import Scene

LUMA = np.array([0.299, 0.587, 0.114])  # BT.601
LUMA_SCALE = 219 / 255  # of the limited range that video files use
OURS, PEER = "ours", "peer"
WHOLE, ALONE = "whole run", "localiser"
_LONGEST_S = 2.0  # of CPU for one follower on one clip: the slow ones see fewer frames
_COLUMNS = (
    "clip", "method", "kind", "rms_x_px", "rms_y_px", "spread_px", "std_of_error_over_sigma", "ok_fraction",
    "us_per_frame", "decode_us_per_frame", "bound_px",
)  # fmt: skip


@dataclass(frozen=True)
class Clip:
    """One film: its name, its scene and how its file is stored."""

    name: str
    scene: Scene


@dataclass(frozen=True)
class Result:
    """One method on one clip. Errors in px, rms per axis over found frames; `spread_px` is the rms over both axes after
    the constant offset is removed; `std_of_error_over_sigma` only where the method states a σ."""

    clip: str
    method: str
    kind: str
    rms_x_px: float
    rms_y_px: float
    spread_px: float
    std_of_error_over_sigma: float
    ok_fraction: float
    us_per_frame: float
    decode_us_per_frame: float
    bound_px: float


def measure(folder: str | Path, quick: bool = False, progress: Progress = silent) -> str:
    """Render, track and compare; write tracking.csv, tracking.txt and tracking.png/.svg into `folder`; return the text."""
    folder = Path(folder)
    results = measure_tracking(quick, progress)
    with (folder / "tracking.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(_COLUMNS)
        for r in results:
            row = [getattr(r, column) for column in _COLUMNS]
            writer.writerow([v if isinstance(v, str) else f"{v:.4g}" for v in row])
    text = describe(results, quick)
    (folder / "tracking.txt").write_text(text + "\n", encoding="utf-8")
    _draw(results, folder / "tracking")
    return text


def measure_tracking(quick: bool = False, progress: Progress = silent) -> list[Result]:
    """Every method on every clip."""
    from toolkit.trackers import tracker_names
    from toolkit.video import open_video

    chosen = clips(quick)
    results: list[Result] = []
    steps = len(chosen) * (2 * len(tracker_names()) + len(PEERS) + 2)
    done = 0

    def tell(what: str) -> None:
        nonlocal done
        progress(what, done / steps)
        done += 1

    with tempfile.TemporaryDirectory() as scratch:
        for number, clip in enumerate(chosen):
            tell(f"{clip.name}: rendering")
            film = Path(scratch) / f"clip{number}.mkv"
            truth = render(clip.scene, film)
            bound = float(np.hypot(*cramer_rao_px(stage(clip.scene))) / math.sqrt(2))
            tell(f"{clip.name}: decoding")
            decode_s = min(_decoding_s(open_video(film)) for _ in range(2))
            common = (clip.name, 1e6 * decode_s / truth.frame.size, bound)
            for name in tracker_names():
                tell(f"{clip.name}: {name}")
                results += _run_ours(film, name, truth, common, warm=number == 0)
            keep = [frame.copy() for frame in _lumas(open_video(film))]
            runs = {f"{name} {ALONE}": localiser(name, clip.scene, truth) for name in tracker_names()}
            for name, prepare in {**runs, **PEERS}.items():
                tell(f"{clip.name}: {name}")
                results += _run_follower(name, OURS if name in runs else PEER, prepare, keep, truth, common)
            film.unlink()
    progress("writing", 1.0)
    return results


def clips(quick: bool = False) -> tuple[Clip, ...]:
    """The films: resolution and radius, bit rate, and one with a shutter open for half a frame."""
    lossless = {"name": "lossless"}
    sizes = {"480p": (640, 480, 14.0), "720p": (1280, 720, 20.0), "1080p": (1920, 1080, 30.0)}

    def clip(size: str, label: str, codec: dict[str, Any], longest_s: float = 4.0, **effects: Any) -> Clip:
        width, height, radius = sizes[size]
        reach = 0.72 * height
        table = {
            "pendulum": {"mass_kg": 0.1, "length_m": 0.5, "bob_radius_m": 0.5 * radius / reach},
            "release": {"theta0_rad": 0.35},
            "effects": {"linear_drag": {"k_d_kg_per_s": 1e-3}},
            "camera": {
                "width_px": width, "height_px": height, "fps": 60, "duration_s": 1.8 if quick else longest_s, "seed": 11,
                "px_per_m": reach / 0.5, "pivot_px": [width / 2 + 0.3, 0.08 * height + 0.4],
                "sensor_noise": {"read_sigma": 2.0}, "codec": codec, **effects,
            },
        }  # fmt: skip
        return Clip(f"{size} {label}", Scene.from_dict(table))

    def rated(megabit: float) -> dict[str, Any]:
        return {"name": "h264", "bit_rate_bit_per_s": megabit * 1e6}

    small, plain = clip("480p", "2 Mbit/s", rated(2)), clip("720p", "8 Mbit/s", rated(8))
    if quick:
        return small, plain
    return (
        small,
        clip("480p", "lossless", lossless, 2.0),  # decoding it takes longer than all else
        plain,
        clip("720p", "1 Mbit/s", rated(1)),
        clip("720p", "8 Mbit/s, half-frame blur", rated(8), motion_blur={"exposure_s": 0.5 / 60}),
        clip("1080p", "12 Mbit/s", rated(12)),
    )


def cramer_rao_px(studio: Studio) -> tuple[float, float]:
    """Least possible σ in px, along x and y, of any unbiased localiser of the film's luma before its codec.

    Independent noise σ on every pixel and a bob of contrast C on an even wall: σ/(C √Σ(∂α/∂x)²), α being the coverage
    of the (blurred) disc; for a still disc of radius R and edge width s this is (σ/C) √(2 s/(√π R)). Rounding to whole
    levels counts as noise. The median over the film.
    """
    from toolkit.camera.paint import cover_disc

    shoot = studio.shoot
    contrast = abs(float(LUMA @ (np.array(shoot.wall_rgb) - np.array(shoot.bob_rgb)))) * LUMA_SCALE
    level = float(np.mean([*shoot.wall_rgb, *shoot.bob_rgb]))
    variance = shoot.read_sigma**2 + shoot.shot_sigma_at_white**2 * level / 255
    noise = math.sqrt(variance * float(LUMA @ LUMA) * LUMA_SCALE**2 + 1 / 12)
    bounds = []
    for centres, shapes, _, rests in studio.exposures[:: max(1, len(studio.exposures) // 12)]:
        row = []
        for axis in np.eye(2):
            (x0, y0, a, _), (x1, y1, b, _) = (
                cover_disc(centres + side * 1e-3 * axis, shapes, studio.sigma_px, rests=rests) for side in (-1, 1)
            )
            if (x0, y0, a.shape) == (x1, y1, b.shape):  # else a pixel row came in: this film has other frames
                row.append(noise / (contrast * math.sqrt(np.sum(((b - a) / 2e-3) ** 2))))
        if len(row) == 2:
            bounds.append(row)
    x, y = np.median(np.array(bounds), axis=0)
    return float(x), float(y)


def _timed(run: Callable[[], Any]) -> tuple[float, Any]:
    began = time.process_time()
    value = run()
    return time.process_time() - began, value


def _decoding_s(video: Any) -> float:
    return _timed(lambda: sum(1 for _ in _lumas(video)))[0]


def _lumas(video: Any) -> Iterator[np.ndarray]:
    for frame in video:
        yield frame.luma


def _run_ours(film: Path, name: str, truth: Truth, common: tuple[str, float, float], warm: bool) -> list[Result]:
    from toolkit.track import track

    try:
        if warm:
            track(film, localiser=name)  # compiles, once on a machine
        seconds, found = _timed(lambda: track(film, localiser=name))
    except JobError:
        return []
    ok = found.ok
    dx, dy = (found.x_px - truth.x_px[found.frame])[ok], (found.y_px - truth.y_px[found.frame])[ok]
    std = float(np.std(np.concatenate([dx / found.sigma_x_px[ok], dy / found.sigma_y_px[ok]])))
    return [_result(f"{name} {WHOLE}", OURS, dx, dy, std, ok.mean(), 1e6 * seconds / truth.frame.size, common)]


def _result(
    name: str,
    kind: str,
    dx: np.ndarray,
    dy: np.ndarray,
    std: float,
    ok: float,
    us: float,
    common: tuple[str, float, float],
) -> Result:
    clip, decode_us, bound = common
    rms = [float(np.sqrt(np.mean(d**2))) for d in (dx, dy)]
    spread = math.sqrt((np.var(dx) + np.var(dy)) / 2)
    return Result(clip, name, kind, rms[0], rms[1], spread, std, float(ok), us, decode_us, bound)


# --- localisers alone, ours and peers' ----------------------------------------------------------------------------------


def _run_follower(
    name: str, kind: str, prepare: Prepare, frames: list[np.ndarray], truth: Truth, common: tuple[str, float, float]
) -> list[Result]:
    radius = float(truth.radius_px[0])
    try:
        locate = prepare(frames, float(truth.x_px[0]), float(truth.y_px[0]), radius)
    except ImportError:
        return []  # an extra that is not installed

    def follow() -> list[tuple[float, float] | None]:
        path: list[tuple[float, float] | None] = []
        recent = [(float(truth.x_px[0]), float(truth.y_px[0]))] * 2
        began = time.process_time()
        for frame in frames:
            if time.process_time() - began > _LONGEST_S and len(path) > 20:
                break
            (x0, y0), (x1, y1) = recent
            found = locate(frame, 2 * x1 - x0, 2 * y1 - y0)
            path.append(found)
            recent = [recent[1], found or (2 * x1 - x0, 2 * y1 - y0)]
        return path

    locate(frames[0], float(truth.x_px[0]), float(truth.y_px[0]))  # whatever happens only once
    seconds, path = _timed(follow)
    found = np.array([p is not None for p in path])
    if not found.any():
        return []
    where = np.array([p for p in path if p is not None])
    at = np.flatnonzero(found)
    dx, dy = where[:, 0] - truth.x_px[at], where[:, 1] - truth.y_px[at]
    near = np.hypot(dx, dy) < radius  # beyond that it follows something else
    if near.mean() < 0.2:
        return []
    return [
        _result(name, kind, dx[near], dy[near], math.nan, near.sum() / len(path), 1e6 * seconds / len(path), common)
    ]


# --- what is written ---------------------------------------------------------------------------------------------------


def _with_decoding(r: Result) -> float:
    return r.us_per_frame + (0.0 if r.method.endswith(WHOLE) else r.decode_us_per_frame)


def describe(results: list[Result], quick: bool) -> str:
    """The table as text."""
    lines = [
        "Tracking: error against time per frame" + (" (quick: short clips)" if quick else ""),
        "rms in px per axis against the rendered truth; spread: after the constant offset is removed; bound: Cramér–Rao",
        "of the luma before the codec. Time is CPU time a frame: a whole run is our command with decoding and search; all others",
        "are given decoded frames, the bob's radius and first place, and a window about where it must be next.",
        "",
    ]
    for clip in dict.fromkeys(r.clip for r in results):
        group = [r for r in results if r.clip == clip]
        lines += [
            f"{clip}: decoding alone {group[0].decode_us_per_frame:.0f} µs a frame, bound {group[0].bound_px:.4f} px",
            f"  {'method':24s} {'rms x':>8s} {'rms y':>8s} {'spread':>8s} {'error/σ':>8s} {'found':>7s} {'µs/frame':>9s}  of decoding's rate",
        ]
        for r in group:
            total = _with_decoding(r)
            std = f"{r.std_of_error_over_sigma:8.2f}" if np.isfinite(r.std_of_error_over_sigma) else "       –"
            lines.append(
                f"  {r.method:24s} {r.rms_x_px:8.4f} {r.rms_y_px:8.4f} {r.spread_px:8.4f} {std} {r.ok_fraction:7.1%} "
                f"{r.us_per_frame:9.0f}  {r.decode_us_per_frame / total:.2f}"
            )
        lines.append("")
    return "\n".join(lines).rstrip()


def _draw(results: list[Result], path: Path) -> None:
    """A panel a clip: our localisers in colours (full: the whole run, hollow: alone), peers in grey."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    clips = list(dict.fromkeys(r.clip for r in results))
    columns = min(3, len(clips))
    rows = math.ceil(len(clips) / columns)
    figure = Figure(figsize=(4.4 * columns, 3.7 * rows + 0.9), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(rows, columns, squeeze=False, sharey=True).ravel()
    ours = list(
        dict.fromkeys(r.method.rsplit(" ", 1 + (r.method.endswith(WHOLE)))[0] for r in results if r.kind == OURS)
    )
    colour = dict(zip(ours, ("#009E73", "#E69F00", "#0072B2", "#D55E00", "#CC79A7", "#56B4E9", "#882255")))
    mark = dict(zip(dict.fromkeys(r.method for r in results if r.kind == PEER), "sD^vPX*"))
    plain = FuncFormatter(lambda value, _: f"{value:g}")
    for panel, clip in zip(panels, clips):
        group = {r.method: r for r in results if r.clip == clip}

        def at(r: Result) -> tuple[float, float]:
            return _with_decoding(r) / 1e3, math.hypot(r.rms_x_px, r.rms_y_px) / math.sqrt(2)

        for name in ours:
            pair = [group[m] for m in (f"{name} {ALONE}", f"{name} {WHOLE}") if m in group]
            panel.plot(*zip(*map(at, pair)), color=colour[name], linewidth=0.8, alpha=0.6, zorder=2)
            for r in pair:
                whole = r.method.endswith(WHOLE)
                panel.plot(*at(r), "o", color=colour[name], markersize=8, markeredgewidth=1.6,
                           markerfacecolor=colour[name] if whole else "white", zorder=4 if whole else 3)  # fmt: skip
        for name in mark:
            if name in group:
                panel.plot(*at(group[name]), mark[name], color="0.45", markersize=7, zorder=3)
        some = next(iter(group.values()))
        panel.axhline(some.bound_px, color="0.2", linestyle="--", linewidth=1, zorder=1)
        panel.axvline(some.decode_us_per_frame / 1e3, color="0.2", linestyle=":", linewidth=1, zorder=1)
        panel.annotate("Cramér–Rao bound", (1, some.bound_px), (-4, 3), xycoords=("axes fraction", "data"),
                       textcoords="offset points", ha="right", fontsize=8, color="0.2")  # fmt: skip
        panel.annotate("decoding alone", (some.decode_us_per_frame / 1e3, 1), (-4, -4), xycoords=("data", "axes fraction"),
                       textcoords="offset points", ha="right", va="top", rotation=90, fontsize=8, color="0.2")  # fmt: skip
        panel.set(xscale="log", yscale="log", title=clip)
        panel.set_xlim(some.decode_us_per_frame / 1e3 / 1.7, None)
        panel.xaxis.set_major_locator(LogLocator(10, (1, 2, 3, 5)))
        panel.xaxis.set_minor_formatter(NullFormatter())
        for axis in (panel.xaxis, panel.yaxis):
            axis.set_major_formatter(plain)
        panel.grid(True, which="major", color="0.9", zorder=0)
    for panel in panels[len(clips) :]:
        panel.set_visible(False)
    for panel in panels[max(0, len(clips) - columns) : len(clips)]:
        panel.set_xlabel("CPU time a frame, decoding included (ms)")
    for panel in panels[::columns]:
        panel.set_ylabel("rms error per axis (px)")
    key = [
        Line2D([], [], marker="o", linestyle="", color=colour[name], label=f"ours: {name.replace('_', ' ')}")
        for name in ours
    ]
    key += [
        Line2D([], [], marker="o", linestyle="", color="0.2", markerfacecolor=face, label=label)
        for face, label in (("0.2", "whole run, search included"), ("white", "localiser alone, helped as peers are"))
    ]
    key += [Line2D([], [], marker=mark[name], linestyle="", color="0.45", label=name) for name in mark]
    figure.legend(handles=key, loc="outside lower center", ncols=4 if columns > 1 else 2, fontsize=9, frameon=False)
    for suffix in (".png", ".svg"):
        figure.savefig(path.with_suffix(suffix), dpi=130)
