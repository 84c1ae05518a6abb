"""The page: a recording in, optional clicks on its first frame, the report out. It calls what the command calls."""

from __future__ import annotations

import asyncio
import base64
import logging
import os
import shutil
import tempfile
import uuid
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from nicegui import app, events, ui

from toolkit.analyse import SERIES_SUFFIXES, VIDEO_SUFFIXES, is_video
from toolkit.errors import PendulabError
from toolkit.make_report import make_report
from toolkit.report.html import font_face
from toolkit.report.speech import say_error
from toolkit.report.words import Words, languages, load_words
from toolkit.scene import Environment, Pendulum, Scene

_NUMBERS = {"mass": None, "length": None, "radius": None, "gravity": 9.80665, "slow": 1.0}


@dataclass
class _Visit:
    """What one visitor has put in so far."""

    folder: Path
    recording: Path | None = None
    picture: tuple[str, tuple[int, int]] | None = None  # the first frame of a video, as `_first_frame` gives it
    numbers: dict[str, float | None] = field(default_factory=lambda: dict(_NUMBERS))
    clicks: dict[str, tuple[float, float]] = field(default_factory=dict)
    stage: tuple[str, float] = ("", 0.0)


def build_page() -> None:
    """Lay out the page for one visitor."""
    visit = _Visit(Path(tempfile.mkdtemp(prefix="pendulab-")))
    ui.context.client.on_delete(lambda: shutil.rmtree(visit.folder, ignore_errors=True))

    @ui.refreshable
    def content(lang: str) -> None:
        _content(visit, lang)

    ui.add_css(font_face() + 'body{font-family:Roboto,"Noto Sans Thai",sans-serif}')
    with ui.column().classes("w-full max-w-3xl mx-auto p-4 gap-4"):
        choice = (
            ui.toggle({lang: load_words(lang)("language.name") for lang in languages()}, value="en")
            .classes("self-end")
            .mark("lang")
        )
        content("en")
    choice.on_value_change(lambda event: content.refresh(event.value))


def _content(visit: _Visit, lang: str) -> None:
    words = load_words(lang)
    ui.label(words("web.title")).classes("text-2xl")
    frame_place = ui.column().classes("w-full")

    async def receive(event: events.UploadEventArguments) -> None:
        path = visit.folder / Path(event.file.name).name
        await event.file.save(path)
        visit.recording, visit.picture, visit.clicks = path, None, {}
        try:
            if is_video(path):
                visit.picture = await asyncio.to_thread(_first_frame, path)
        except PendulabError as error:
            ui.notify(_told(error, visit, words), type="negative", multi_line=True)
        show()

    def show() -> None:
        frame_place.clear()
        with frame_place:
            if visit.recording is not None:
                ui.label(visit.recording.name).classes("font-bold")
            if visit.picture is not None:
                _frame(visit, words, *visit.picture)

    accept = ",".join(sorted(VIDEO_SUFFIXES | SERIES_SUFFIXES))
    upload = ui.upload(label=words("web.upload"), auto_upload=True, on_upload=receive).props(f'accept="{accept}"')
    upload.classes("w-full").move(target_index=1)
    with ui.row().classes("w-full"):
        for name in _NUMBERS:
            box = ui.number(words(f"web.{name}"), min=0, format="%.6g").bind_value(visit.numbers, name)
            box.classes("w-full sm:w-80").mark(name)
    result = ui.column().classes("w-full")

    async def go() -> None:
        if visit.recording is None:
            ui.notify(words("web.upload"))
            return
        result.clear()
        button.disable()
        with result:
            text = ui.label(words("web.working"))
            bar = ui.linear_progress(0.0, show_value=False)

        def show_stage() -> None:
            stage, bar.value = visit.stage
            text.text = words.either(f"web.stage.{stage}", stage) or words("web.working")

        timer = ui.timer(0.2, show_stage)
        try:
            mass, length, radius, gravity, slow = (visit.numbers[name] or None for name in _NUMBERS)
            scene = Scene(pendulum=Pendulum(mass, length, radius), environment=Environment(g_m_per_s2=gravity))
            await _analyse(visit, scene, words, slow or 1.0, result)
        except Exception as error:
            if not isinstance(error, PendulabError):
                logging.getLogger(__name__).exception("a report could not be made")
            result.clear()
            with result:
                ui.label(_told(error, visit, words)).classes("text-red-700 dark:text-red-300").mark("trouble")
        finally:
            timer.cancel()
            button.enable()

    button = ui.button(words("web.go"), on_click=go).mark("go")
    button.move(target_index=-1)
    result.move(target_index=-1)
    show()


def _told(error: Exception, visit: _Visit, words: Words) -> str:
    """The error in the visitor's language, without the folder that their file was put into."""
    if not isinstance(error, PendulabError):
        return f"{words('web.trouble')} ({type(error).__name__})"
    told = say_error(words, str(error).replace(f"{visit.folder}{os.sep}", ""))
    return f"{told} – {words('web.click_here')}" if "--bob" in told else told


def _frame(visit: _Visit, words: Words, picture: str, size: tuple[int, int]) -> None:
    ui.label(words("web.clicks"))
    what = ui.toggle({"bob": words("web.bob"), "pivot": words("web.pivot")}, value="bob")

    def marks() -> str:
        colours = {"bob": "#d55e00", "pivot": "#0072b2"}
        radius = max(size) / 80
        return "".join(
            f'<circle cx="{x}" cy="{y}" r="{radius}" fill="none" stroke="{colours[name]}" stroke-width="{radius / 3}"/>'
            for name, (x, y) in visit.clicks.items()
        )

    def click(event: events.MouseEventArguments) -> None:
        visit.clicks[what.value] = (event.image_x, event.image_y)
        image.content = marks()

    def forget() -> None:
        visit.clicks.clear()
        image.content = ""

    image = ui.interactive_image(picture, on_mouse=click, cross=True, sanitize=False).classes("w-full").mark("frame")
    image.content = marks()
    ui.button(words("web.forget"), on_click=forget).props("flat")


async def _analyse(visit: _Visit, scene: Scene, words: Words, fps_factor: float, result: Any) -> None:
    recording = visit.recording
    assert recording is not None
    out = visit.folder / f"report-{uuid.uuid4().hex}"
    measuring: dict[str, Any] = {}
    if is_video(recording):
        measuring = {"fps_factor": fps_factor, **{name: visit.clicks.get(name) for name in ("bob", "pivot")}}

    def progress(stage: str, fraction: float) -> None:
        visit.stage = (stage, fraction)

    analysis, _ = await asyncio.to_thread(
        lambda: make_report(recording, out, scene, lang=words.lang, overlay=True, progress=progress, **measuring)
    )
    archive = await asyncio.to_thread(shutil.make_archive, str(out), "zip", out)
    address = f"/results/{out.name}"
    app.add_static_files(address, out)
    zip_address = app.add_static_file(local_file=archive, url_path=f"{address}.zip")
    from toolkit.report.notebook import analysis_html

    result.clear()
    with result:
        ui.link(words("web.open"), f"{address}/report.html", new_tab=True).mark("report")
        ui.link(words("web.all"), zip_address).mark("zip")
        ui.html(analysis_html(analysis, words.lang), sanitize=False)  # every text in it is escaped


def _first_frame(path: Path) -> tuple[str, tuple[int, int]]:
    """The first frame as a data address, and its size in px."""
    import cv2

    from toolkit.video import open_video

    frame = next(iter(open_video(path)))
    coded = cv2.imencode(".jpg", frame.bgr, [cv2.IMWRITE_JPEG_QUALITY, 90])[1]
    height, width = frame.luma.shape
    return f"data:image/jpeg;base64,{base64.b64encode(coded.tobytes()).decode()}", (width, height)
