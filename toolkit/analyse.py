"""The main job: from a recording to θ(t), fits and findings. The command line, a batch and a notebook call this."""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import nullcontext, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from toolkit.checks.finding import Finding
from toolkit.compile_ahead import compile_ahead
from toolkit.errors import JobError, UsageError
from toolkit.fit import FitResult
from toolkit.progress import Progress, silent
from toolkit.scene import Scene
from toolkit.series import ThetaSeries
from toolkit.track import Track

VIDEO_SUFFIXES = frozenset({".mp4", ".mov", ".avi", ".mkv", ".webm", ".m4v", ".3gp", ".mpg", ".mpeg", ".wmv", ".mts"})
SERIES_SUFFIXES = frozenset({".csv", ".tsv", ".txt", ".dat", ".trk", ".trz", ".zip"})


@dataclass(frozen=True)
class Analysis:
    """All that one recording told: what `build_report` writes down.

    source : the recording.    scene : what was known of the experiment.    series : θ(t).
    fits : model name -> FitResult.    preferred : the model that the data prefer.    findings : the verdicts.
    track, video : the bob's track and the clip it came from; None for a recording that was a θ(t) file.
    timings_s : wall seconds of each stage.
    """

    source: Path
    scene: Scene
    series: ThetaSeries
    fits: dict[str, FitResult]
    preferred: str
    findings: list[Finding]
    track: Track | None = None
    video: Path | None = None
    timings_s: dict[str, float] = field(default_factory=dict)

    @property
    def best(self) -> FitResult:
        """The preferred model's fit."""
        return self.fits[self.preferred]

    @property
    def log(self) -> tuple[str, ...]:
        """What was done to the data, in order, one sentence each."""
        return tuple(self.series.meta.get("log", ()))

    def _repr_html_(self) -> str:
        from toolkit.report.notebook import analysis_html

        return analysis_html(self)


def is_video(path: str | Path) -> bool:
    """True for a video file or a folder of images, False for a θ(t) file.

    Raises JobError where nothing is there, UsageError for a suffix that is neither.
    """
    path = Path(path)
    if not path.exists():
        raise JobError(f"{path} does not exist; check the name and the folder")
    suffix = path.suffix.lower()
    if path.is_dir() or suffix in VIDEO_SUFFIXES:
        return True
    if suffix in SERIES_SUFFIXES:
        return False
    known = " ".join(sorted(VIDEO_SUFFIXES | SERIES_SUFFIXES))
    raise UsageError(f"{path.name}: neither a video nor a θ(t) file by its ending; known endings are {known}")


def measure(
    path: str | Path,
    scene: Scene | None = None,
    *,
    start_s: float | None = None,
    stop_s: float | None = None,
    progress: Progress = silent,
    **tracking: Any,
) -> tuple[ThetaSeries, Track | None]:
    """θ(t) of a recording: tracked and calibrated from a video, or read from a file.

    start_s, stop_s : the part to use, in the recording's own time.
    tracking : `pivot`, `bob` (x, y in px), `radius` (px), `fps_factor`, `localiser`: passed on to `track`.
    Raises JobError where no pendulum is found or the file cannot be read.
    """
    scene = scene or Scene()
    if is_video(path):
        from toolkit.calibrate import calibrate
        from toolkit.track import track

        found = track(path, start_s=start_s, stop_s=stop_s, progress=progress, **tracking)
        return calibrate(found, scene), found
    from toolkit.series_io import read_series

    series = read_series(path)
    if start_s is not None or stop_s is not None:
        series = series.between(start_s, stop_s)
    return series, None


def analyse(
    path: str | Path,
    scene: Scene | None = None,
    *,
    models: Sequence[str] | None = None,
    progress: Progress = silent,
    **measuring: Any,
) -> Analysis:
    """The whole job on one recording: measure, fit every model of the ladder, judge the assumptions.

    measuring : passed on to `measure`. Raises what `measure` raises; a fit that fails is a result, not an error.
    """
    scene = scene or Scene()
    path = Path(path)
    timings: dict[str, float] = {}
    clock = time.perf_counter()

    def stage_done(stage: str) -> None:
        nonlocal clock
        now = time.perf_counter()
        timings[stage] = now - clock
        clock = now

    with compile_ahead() if is_video(path) else nullcontext() as ahead:
        series, found = measure(path, scene, progress=progress, **measuring)
        if ahead is not None:
            progress("compiling the equations, this once", 0.0)
            with suppress(Exception):  # what fails here fails again, and is told, where it is needed
                ahead.result()
    scene = _with_what_the_recording_says(scene, series)
    stage_done("measure")
    from toolkit.diagnose import diagnose
    from toolkit.fit import choose_model, fit_models

    fits = fit_models(series, scene, models, progress=progress)
    stage_done("fit")
    findings = diagnose(series, fits, scene)
    stage_done("diagnose")
    return Analysis(
        source=path,
        scene=scene,
        series=series,
        fits=fits,
        preferred=choose_model(fits),
        findings=findings,
        track=found,
        video=path if found is not None else None,
        timings_s=timings,
    )


def _with_what_the_recording_says(scene: Scene, series: ThetaSeries) -> Scene:
    """The scene with the mass that the recording's file gives (a Tracker project), where the scene gives none.

    A length in such a file is what its user calibrated with, not a tape along the string: it stays in `meta`.
    """
    mass_kg = series.meta.get("mass_kg")
    if mass_kg is None or scene.pendulum.mass_kg is not None:
        return scene
    return replace(scene, pendulum=replace(scene.pendulum, mass_kg=float(mass_kg)))


def write_analysis(analysis: Analysis, folder: Path) -> list[Path]:
    """Write theta.csv, fit.json and residuals.csv, and for a video track.csv and calibration.json, into `folder`."""
    from toolkit.fit_file import write_fit_json, write_residuals_csv

    written = write_measurement(analysis.series, analysis.track, folder)
    write_fit_json(folder / "fit.json", analysis.series, analysis.fits, analysis.findings, analysis.preferred)
    write_residuals_csv(folder / "residuals.csv", analysis.series, analysis.fits, analysis.preferred)
    return [*written, folder / "fit.json", folder / "residuals.csv"]


def write_measurement(series: ThetaSeries, found: Track | None, folder: Path) -> list[Path]:
    """Write theta.csv and, for a video, track.csv and calibration.json into `folder`."""
    written = [folder / "theta.csv"]
    series.to_csv(written[0])
    if found is not None:
        from toolkit.calibrate import write_calibration_json
        from toolkit.track import write_track_csv

        write_track_csv(found, folder / "track.csv")
        write_calibration_json(series, folder / "calibration.json")
        written += [folder / "track.csv", folder / "calibration.json"]
    return written
