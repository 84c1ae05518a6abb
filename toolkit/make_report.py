"""One recording to one folder of results: what the command `report`, the demo, a class and the web page all call."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any

from toolkit.analyse import Analysis, analyse, write_analysis
from toolkit.beside import Beside
from toolkit.output import whole_folder
from toolkit.progress import Progress, silent
from toolkit.scene import Scene


def make_report(
    recording: str | Path,
    out: str | Path,
    scene: Scene | None = None,
    *,
    formats: Sequence[str] = ("html", "pdf"),
    lang: str = "en",
    overlay: bool = False,
    models: Sequence[str] | None = None,
    progress: Progress = silent,
    **measuring: Any,
) -> tuple[Analysis, list[Path]]:
    """Analyse `recording` and write all results and the report into the folder `out`, whole or not at all.

    measuring : passed on to `measure` (`start_s`, `stop_s`, `pivot`, `bob` …).
    Returns the analysis and the paths of the report's files. Raises UsageError for an unknown format or language
    before anything is done, JobError where the recording cannot be used.
    """
    from toolkit.report import build_report, check_choice, import_ahead, write_report

    check_choice(formats, lang)
    import_ahead(formats)
    out = Path(out)
    with whole_folder(out) as folder:
        analysis = analyse(recording, scene, models=models, progress=progress, **measuring)
        write_analysis(analysis, folder)
        progress("writing the report", 0.0)
        with _film(analysis, folder) if overlay else nullcontext() as film:
            written = write_report(build_report(analysis, lang=lang), folder, formats)
            if film is not None:
                progress("writing the overlay", 0.5)
                film.result()
    return analysis, [out / path.name for path in written]


def _film(analysis: Analysis, folder: Path) -> AbstractContextManager[Beside | None]:
    """The overlay, being written while figures are drawn; nothing for a recording that is no video."""
    if analysis.track is None or analysis.video is None:
        return nullcontext()
    from toolkit.overlay import write_overlay

    return Beside(write_overlay, analysis.video, analysis.track, folder / "overlay.mp4", analysis.best.theta_rad)
