"""The page is served to this computer only, and makes the same report as the command."""

from __future__ import annotations

import asyncio
import os
import socket
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

import pytest

pytest.importorskip("nicegui", reason="the web page is an extra: pip install 'pendulab[web]'")

ROOT = Path(__file__).resolve().parents[1]


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def test_the_page_is_served_and_asks_no_other_host():
    port = free_port()
    code = f"from toolkit.web import serve; serve({port}, show=False)"
    outside = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST")}
    server = subprocess.Popen([sys.executable, "-c", code], cwd=ROOT, env=outside, stderr=subprocess.DEVNULL)
    try:
        page = b""
        for _ in range(120):
            try:
                page = urllib.request.urlopen(f"http://127.0.0.1:{port}/", timeout=10).read()
                break
            except OSError:
                assert server.poll() is None, "the server ended"
                time.sleep(0.5)
        assert b"From a video of a pendulum to a report" in page
        assert b'src="http' not in page
        assert b'href="http' not in page
    finally:
        server.terminate()
        server.wait(20)


def test_a_port_in_use_or_impossible():
    from toolkit import JobError, UsageError
    from toolkit.web import serve

    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with pytest.raises(JobError, match="--port"):
            serve(taken.getsockname()[1], show=False)
    with pytest.raises(UsageError, match="70000"):
        serve(70000, show=False)


def test_the_first_frame_is_shown_in_its_own_pixels():
    from toolkit.web.page import _first_frame

    address, size = asyncio.run(asyncio.to_thread(_first_frame, ROOT / "data" / "samples" / "pendulum.mp4"))
    assert size == (640, 480)
    assert address.startswith("data:image/jpeg;base64,")


@pytest.mark.parametrize("lang", ["en", "th"])
def test_where_the_tracker_asks_for_a_click_the_page_says_how(lang, tmp_path):
    from toolkit import JobError
    from toolkit.report.words import load_words
    from toolkit.tracking.begin.acquire import REMEDY
    from toolkit.web.page import _told, _Visit

    words, visit = load_words(lang), _Visit(tmp_path)
    asked = JobError(f"nothing in {tmp_path / 'a.mp4'} moves like a pendulum; if there is one, {REMEDY}")
    told = _told(asked, visit, words)
    assert "a.mp4" in told
    assert str(tmp_path) not in told
    assert told.endswith(words("web.click_here"))
    assert words("web.click_here") not in _told(JobError("a.mp4 is empty (0 bytes)"), visit, words)


def test_what_was_put_in_stays_when_the_language_is_changed():
    from nicegui import ui
    from nicegui.testing import user_simulation

    from toolkit.report.words import load_words
    from toolkit.web.page import build_page

    film = ROOT / "data" / "samples" / "pendulum.mp4"

    async def visit() -> None:
        async with user_simulation(root=build_page) as user:
            await user.open("/")
            user.find(marker="mass").type("0.25")
            (upload,) = user.find(ui.upload).elements
            await upload.handle_uploads([ui.upload.SmallFileUpload(film.name, "video/mp4", film.read_bytes())])
            await user.should_see(marker="frame", retries=50)
            (choice,) = user.find(marker="lang").elements
            choice.set_value("th")
            await user.should_see(load_words("th")("web.go"))
            await user.should_see(film.name)
            await user.should_see(marker="frame")
            assert [box.value for box in user.find(marker="mass").elements] == [0.25]

    asyncio.run(visit())
