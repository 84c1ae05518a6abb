"""The command `pendulab`: parse, call, print. No physics; heavy imports stay inside the commands."""

import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from inspect import Parameter, Signature, signature
from pathlib import Path
from threading import Event
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from toolkit.analyse import Analysis
    from toolkit.progress import Progress
    from toolkit.scene import Scene

app = typer.Typer(
    name="pendulab",
    help="From a phone video of a pendulum to θ(t) with error bars, fitted models, and a report.",
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)

Out = Annotated[Path | None, typer.Option("--out", help="Folder for the results (made if need be).")]
Lang = Annotated[str, typer.Option("--lang", help="Language of the report: en or th.")]
Formats = Annotated[str, typer.Option("--format", help="Any of html,pdf,tex,md,xlsx, with commas.")]
Models = Annotated[list[str] | None, typer.Option("--model", help="Fit this model only; may be given again.")]
Overlay = Annotated[
    bool, typer.Option("--overlay", help="Also write overlay.mp4: track, pivot and model on the video.")
]
Quick = Annotated[bool, typer.Option("--quick", help="Fewer cases, in under a minute.")]


def known_scene(
    scene: Annotated[Path | None, typer.Option("--scene", help="Scene file (TOML) with what is known.")] = None,
    mass_kg: Annotated[float | None, typer.Option("--mass-kg", help="Mass of the bob in kg.")] = None,
    length_m: Annotated[float | None, typer.Option("--length-m", help="Length from pivot to bob centre in m.")] = None,
    bob_radius_m: Annotated[float | None, typer.Option("--bob-radius-m", help="Radius of the bob in m.")] = None,
    g: Annotated[
        float | None, typer.Option("--g", help="Gravitational acceleration in m/s² (default 9.80665).")
    ] = None,
) -> "Scene":
    """The scene file's content, or an empty scene, with what the options say put over it."""
    from dataclasses import replace

    from toolkit.scene import Scene

    known = Scene.from_toml(scene) if scene is not None else Scene()
    given = {"mass_kg": mass_kg, "length_m": length_m, "bob_radius_m": bob_radius_m}
    pendulum = replace(known.pendulum, **{name: value for name, value in given.items() if value is not None})
    environment = known.environment if g is None else replace(known.environment, g_m_per_s2=g, latitude_deg=None)
    return replace(known, pendulum=pendulum, environment=environment)


def stretch(
    start: Annotated[float | None, typer.Option("--start", help="Use the recording from this time on, in s.")] = None,
    stop: Annotated[float | None, typer.Option("--stop", help="Use the recording up to this time, in s.")] = None,
) -> dict[str, Any]:
    """What part of the recording is used."""
    return {"start_s": start, "stop_s": stop}


def clicks(
    fps_factor: Annotated[
        float,
        typer.Option("--fps-factor", help="Slow motion: how many times slower the clip plays (8 for 240 shown at 30)."),
    ] = 1.0,
    pivot: Annotated[
        str | None, typer.Option("--pivot", metavar="X,Y", help="Pivot in pixels, instead of finding it.")
    ] = None,
    bob: Annotated[
        str | None, typer.Option("--bob", metavar="X,Y", help="Bob in the first frame used, in pixels.")
    ] = None,
    radius: Annotated[float | None, typer.Option("--radius", help="Radius of the bob in pixels.")] = None,
) -> dict[str, Any]:
    """What the user tells of a video; nothing is in it that was not told."""
    from toolkit.errors import UsageError

    if not fps_factor > 0:
        raise UsageError(f"--fps-factor must be positive, got {fps_factor}")
    if radius is not None and not radius > 0:
        raise UsageError(f"--radius must be positive, got {radius}")
    told = {"pivot": _point(pivot, "--pivot"), "bob": _point(bob, "--bob"), "radius": radius}
    told = {name: value for name, value in told.items() if value is not None}
    return told if fps_factor == 1.0 else {**told, "fps_factor": fps_factor}


def takes(**parts: Callable[..., Any]) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Give a command the options of PARTS too; what a part makes of its options arrives as the argument of its name."""

    def add_options(command: Callable[..., None]) -> Callable[..., None]:
        options = {name: signature(part).parameters for name, part in parts.items()}

        @wraps(command)
        def run(**given: Any) -> None:
            for name, part in parts.items():
                given[name] = part(**{option: given.pop(option) for option in options[name]})
            command(**given)

        own = [p for name, p in signature(command).parameters.items() if name not in parts]
        every = own + [p for one in options.values() for p in one.values()]
        every.sort(key=lambda p: p.default is not Parameter.empty)  # arguments before options
        run.__signature__ = Signature(every)  # type: ignore[attr-defined]
        run.__annotations__ = {p.name: p.annotation for p in every}
        return run

    return add_options


def _print_version(wanted: bool) -> None:
    if wanted:
        from toolkit import __version__

        typer.echo(f"pendulab {__version__}")
        raise typer.Exit


@app.callback(invoke_without_command=True)
def about(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", help="Print the version and stop.", is_eager=True, callback=_print_version)
    ] = False,
) -> None:
    """From a phone video of a pendulum to θ(t) with error bars, fitted models, and a report."""
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())


@app.command()
def demo(out: Out = None, lang: Lang = "en") -> None:
    """The main job on a shipped sample video."""
    from toolkit.samples import sample
    from toolkit.scene import Scene

    _report(
        sample("pendulum.mp4"),
        Scene.from_toml(sample("pendulum.toml")),
        out or Path("pendulab-demo"),
        formats=("html", "pdf"),
        lang=lang,
        overlay=True,
    )


@app.command()
@takes(scene=known_scene, part=stretch, told=clicks)
def track(
    video: Path,
    scene: "Scene",
    part: dict[str, Any],
    told: dict[str, Any],
    out: Out = None,
    localiser: Annotated[str | None, typer.Option("--localiser", help="Use this localiser (see `trackers`).")] = None,
    overlay: Overlay = False,
) -> None:
    """Track the bob in VIDEO: track.csv, theta.csv, calibration.json."""
    from toolkit.analyse import is_video, measure, write_measurement
    from toolkit.errors import UsageError
    from toolkit.output import whole_folder

    if not is_video(video):
        raise UsageError(f"{video.name} is a θ(t) file, not a video: use `pendulab fit` or `pendulab report` on it")
    out = out or Path(f"{video.stem}-track")
    with _progress() as progress, whole_folder(out) as folder:
        series, found = measure(video, scene, progress=progress, localiser=localiser, **part, **told)
        write_measurement(series, found, folder)
        if overlay and found is not None:
            from toolkit.overlay import write_overlay

            write_overlay(video, found, folder / "overlay.mp4", progress=progress)
    if found is not None:
        typer.echo(f"{int(found.ok.sum())} of {len(found.frame)} frames measured by the {found.localiser} localiser")
    _print_warnings(series.meta.get("warnings", ()))
    typer.echo(out / "theta.csv")


@app.command()
@takes(scene=known_scene, part=stretch, told=clicks)
def fit(
    series: Path,
    scene: "Scene",
    part: dict[str, Any],
    told: dict[str, Any],
    out: Out = None,
    model: Models = None,
) -> None:
    """Fit the models to a θ(t) file or a video: fit.json, residuals."""
    from toolkit.analyse import analyse, write_analysis
    from toolkit.output import whole_folder

    _refuse_clicks(series, told)
    out = out or Path(f"{series.stem}-fit")
    with _progress() as progress, whole_folder(out) as folder:
        analysis = analyse(series, scene, models=model, progress=progress, **part, **told)
        write_analysis(analysis, folder)
    _print_analysis(analysis)
    typer.echo(out / "fit.json")


@app.command()
@takes(scene=known_scene, part=stretch, told=clicks)
def report(
    recording: Annotated[Path, typer.Argument(metavar="VIDEO|SERIES")],
    scene: "Scene",
    part: dict[str, Any],
    told: dict[str, Any],
    out: Out = None,
    lang: Lang = "en",
    format: Formats = "html,pdf",
    model: Models = None,
    overlay: Overlay = False,
) -> None:
    """The whole job on a video or a θ(t) file: report.html and .pdf."""
    _refuse_clicks(recording, {**told, "overlay": True} if overlay else told)
    _report(
        recording,
        scene,
        out or Path(f"{recording.stem}-report"),
        formats=_formats(format),
        lang=lang,
        overlay=overlay,
        models=model,
        **part,
        **told,
    )


@app.command()
def simulate(
    scene: Path,
    out: Annotated[Path, typer.Option("--out", help="CSV file to write.")],
    accuracy: Annotated[float, typer.Option("--accuracy", help="Largest error of θ to allow, in rad.")] = 1e-9,
    duration_s: Annotated[float | None, typer.Option("--duration-s", help="Default: the camera's, else 10 s.")] = None,
    rate_hz: Annotated[float | None, typer.Option("--rate-hz", help="Default: the camera's fps, else 100 Hz.")] = None,
) -> None:
    """Solve the motion of SCENE: t, θ, θ̇, tension, energy as CSV."""
    import numpy as np

    from toolkit.errors import UsageError
    from toolkit.output import whole_file
    from toolkit.scene import Scene
    from toolkit.simulate import simulate as solve

    known = Scene.from_toml(scene)
    length = duration_s if duration_s is not None else (known.camera.duration_s if known.camera else 10.0)
    rate = rate_hz if rate_hz is not None else (known.camera.fps if known.camera else 100.0)
    if not length >= 0 or not rate > 0:
        raise UsageError(f"--duration-s must be ≥ 0 and --rate-hz > 0, got {length} and {rate}")
    if length * rate > 2e7:
        raise UsageError(f"{length:g} s at {rate:g} Hz is more than 20 million rows; lower --rate-hz or --duration-s")
    with _progress() as progress:
        progress("solving", 0.0)
        trajectory = solve(known, np.arange(round(length * rate) + 1) / rate, accuracy_rad=accuracy)
        with whole_file(out) as unfinished:
            trajectory.to_csv(unfinished)
    cost = trajectory.cost
    typer.echo(
        f"route: {trajectory.method}; {1e3 * cost.cpu_s:.3g} ms of CPU, {1e3 * cost.compile_s:.3g} ms of compiling"
    )
    if trajectory.error_estimate_rad is not None:
        typer.echo(f"error of θ: about {trajectory.error_estimate_rad:.1e} rad ({accuracy:.1e} asked for)")
    for event in trajectory.events[:20]:
        typer.echo(f"{event.kind} at t = {event.t_s:.6g} s, θ = {event.theta_rad:.6g} rad")
    _print_warnings(trajectory.warnings)
    typer.echo(out)


@app.command()
def render(
    scene: Path,
    out: Annotated[Path, typer.Option("--out", help="Video file to write; its truth goes to NAME.truth.csv.")],
) -> None:
    """Film SCENE: a synthetic video, with its exact truth beside it."""
    from toolkit.render import render as film
    from toolkit.scene import Scene

    with _progress() as progress:
        film(Scene.from_toml(scene), out, progress=progress)
    typer.echo(out)
    typer.echo(out.with_name(f"{out.stem}.truth.csv"))


@app.command()
def cost(
    what: Annotated[str, typer.Argument(metavar="integrators|tracking|fit")],
    out: Out = None,
    quick: Quick = False,
) -> None:
    """What accuracy costs in time, beside public peers, measured here."""
    from toolkit.cost import load_subject
    from toolkit.output import whole_folder

    measure = load_subject(what)
    out = out or Path(f"cost-{what}")
    with _progress() as progress, whole_folder(out) as folder:
        text = measure(folder, quick=quick, progress=progress)
    typer.echo(text)
    typer.echo(out)


@app.command()
def paper(out: Out = None) -> None:
    """The source paper again: 12 panels, a verdict on each claim."""
    from toolkit.output import whole_folder
    from toolkit.paper import reproduce_paper

    out = out or Path("paper")
    with _progress() as progress, whole_folder(out) as folder:
        text = reproduce_paper(folder, progress=progress)
    typer.echo(text)
    typer.echo(out)


@app.command()
@takes(scene=known_scene)
def batch(
    recordings: Annotated[Path, typer.Argument(metavar="FOLDER")],
    scene: "Scene",
    out: Out = None,
    lang: Lang = "en",
    format: Formats = "html,pdf",
    jobs: Annotated[int, typer.Option("--jobs", help="Recordings at once (default: one a processor).")] = 0,
) -> None:
    """A class at once: a report a recording, summary.csv, index.html."""
    from toolkit.batch import analyse_folder
    from toolkit.report.numbers import bare
    from toolkit.report.words import load_words

    out = out or Path(f"{recordings.name}-reports")
    formats = _formats(format)
    with _progress() as progress:
        rows = analyse_folder(recordings, out, scene, lang=lang, formats=formats, jobs=jobs, progress=progress)
    note = load_words(lang)("page.note")
    for row in rows:
        typer.echo(f"{row.recording}: {row.sentence}")
        for line in row.cautions:
            typer.echo(f"  {note}: {bare(line)}")
    typer.echo(out / "index.html")
    if not any(row.done for row in rows):
        raise typer.Exit(1)


@app.command()
def convert(
    source: Annotated[Path, typer.Argument(metavar="IN")],
    target: Annotated[Path, typer.Argument(metavar="OUT")],
) -> None:
    """Between the series formats; the endings say which."""
    from toolkit.series_io import read_series, write_series

    series = read_series(source)
    write_series(series, target)
    _print_warnings(series.meta.get("warnings", ()))
    typer.echo(target)


@app.command()
def web(port: Annotated[int, typer.Option("--port", help="Port on this computer.")] = 8080) -> None:
    """The same by clicking, in a browser on this computer."""
    from toolkit.web import serve

    typer.echo(f"http://127.0.0.1:{port} (Ctrl-C stops it)")
    serve(port)


@app.command()
def effects() -> None:
    """What can act on a pendulum: formulas, units, ranges, references."""
    from toolkit.catalogue import describe_effects

    typer.echo(describe_effects())


@app.command()
def models() -> None:
    """What can be fitted: formulas and parameters with units."""
    from toolkit.catalogue import describe_models

    typer.echo(describe_models())


@app.command()
def trackers() -> None:
    """What can localise a bob."""
    from toolkit.catalogue import describe_trackers

    typer.echo(describe_trackers())


def main() -> None:
    """Run the command; every failure is one line on stderr and an exit code."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # our matrices are small: threads would only wait for each other
    for stream in (sys.stdout, sys.stderr):  # Thai and θ also where the console's own encoding cannot
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(encoding="utf-8", errors="replace")
    signal.signal(signal.SIGINT, _interrupt)
    sys.unraisablehook = _unraisable
    try:
        code = app(prog_name="pendulab", standalone_mode=False)
    except (typer.Abort, KeyboardInterrupt):
        code = 130
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = 0
    except Exception as error:
        from toolkit.errors import PendulabError

        if isinstance(error, PendulabError):
            _fail(str(error), error.exit_code)
        if hasattr(error, "format_message"):  # the command-line parser's own errors
            _fail(error.format_message(), 2, " (--help says more)")
        if os.environ.get("PENDULAB_DEBUG"):
            raise
        if isinstance(error, MemoryError):
            _fail("out of memory; smaller pictures, fewer rows or a shorter part (--start, --stop) need less", 1)
        if isinstance(error, OverflowError):
            _fail(
                "a number given is too large or too small to be calculated with; check the options and their units", 2
            )
        kind = f"{type(error).__name__}: {error}"
        _fail(f"unexpected trouble ({kind}); set PENDULAB_DEBUG=1 to see where, and tell the developers", 1)
    if code == 130:  # Ctrl-C, by whichever way it came through the parser
        _fail("stopped; nothing unfinished was left behind", 130)
    sys.exit(code if isinstance(code, int) else 0)


_interrupted = Event()


def _interrupt(*_: object) -> None:
    """Ctrl-C: raised here and, where some library's code swallows that, again at the next step of the work."""
    _interrupted.set()
    raise KeyboardInterrupt


def _unraisable(trouble: "sys.UnraisableHookArgs") -> None:
    """A Ctrl-C that fell where nothing can be raised (in a finaliser) is not printed: the next step raises it."""
    if not issubclass(trouble.exc_type, KeyboardInterrupt):
        sys.__unraisablehook__(trouble)


def _unless_interrupted(show: "Progress") -> "Progress":
    def step(stage: str, fraction: float) -> None:
        if _interrupted.is_set():
            raise KeyboardInterrupt
        show(stage, fraction)

    return step


def _fail(sentence: str, code: int, tail: str = "") -> None:
    print(f"pendulab: {' '.join(sentence.split())}{tail}", file=sys.stderr)
    sys.exit(code)


def _report(recording: Path, scene: "Scene", out: Path, lang: str, **choices: Any) -> None:
    from toolkit.make_report import make_report

    with _progress() as progress:
        analysis, written = make_report(recording, out, scene, lang=lang, progress=progress, **choices)
    _print_analysis(analysis, lang)
    for path in written:
        typer.echo(path)


def _refuse_clicks(recording: Path, told: dict[str, Any]) -> None:
    """A θ(t) file has no pixels to click or to draw on."""
    from toolkit.analyse import is_video
    from toolkit.errors import UsageError

    if told and not is_video(recording):
        options = "--pivot, --bob, --radius, --fps-factor and --overlay"
        raise UsageError(f"{options} are for videos; {recording.name} is a θ(t) file")


def _formats(text: str) -> tuple[str, ...]:
    return tuple(part.strip() for part in text.split(",") if part.strip())


def _point(text: str | None, option: str) -> tuple[float, float] | None:
    if text is None:
        return None
    from math import isfinite

    from toolkit.errors import UsageError

    try:
        x, y = (float(part) for part in text.split(","))
    except ValueError:
        x = y = float("nan")
    if not (isfinite(x) and isfinite(y)):
        raise UsageError(f"{option} needs two numbers X,Y in pixels (like 320,40), got {text!r}")
    return x, y


def _print_analysis(analysis: "Analysis", lang: str = "en") -> None:
    from toolkit.report.terminal import summary_lines

    for line in summary_lines(analysis, lang):
        typer.echo(line)


def _print_warnings(sentences: Any) -> None:
    for sentence in sentences:
        typer.echo(f"note: {sentence}")


@contextmanager
def _progress() -> "Iterator[Progress]":
    """A progress bar on stderr where that is a terminal; silence elsewhere."""
    from toolkit.progress import silent

    if not sys.stderr.isatty():
        yield _unless_interrupted(silent)
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:3.0f} %"),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("starting", total=1.0)

        def show(stage: str, fraction: float) -> None:
            bar.update(task, description=stage, completed=fraction)

        from toolkit.motion import compiled

        compiled.listener = lambda sentence: show(sentence, 0.0)
        yield _unless_interrupted(show)


if __name__ == "__main__":
    main()
