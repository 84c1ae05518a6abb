"""Work in a second Python: what it returns, what it raises, that it stops, and that it is done here where it must."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from toolkit.beside import Beside
from toolkit.errors import JobError
from toolkit.video import open_video


def test_it_returns_what_the_function_returns_from_another_process() -> None:
    with Beside(os.getpid) as task:
        assert task.result() != os.getpid()


def test_large_arguments_and_results_go_through() -> None:
    values = np.arange(300_000.0)
    with Beside(np.cumsum, values) as task:
        np.testing.assert_array_equal(task.result(), np.cumsum(values))


def test_an_error_there_is_raised_here(tmp_path: Path) -> None:
    with Beside(open_video, tmp_path / "no.mp4") as task, pytest.raises(JobError, match="does not exist"):
        task.result()


def test_leaving_early_stops_the_call() -> None:
    began = time.monotonic()
    with Beside(time.sleep, 60):
        pass
    assert time.monotonic() - began < 30


@pytest.mark.parametrize("executable", ["", "no-such-python"])
def test_without_a_second_python_the_call_is_made_here(executable: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", executable)
    with Beside(os.getpid) as task:
        assert task.result() == os.getpid()


def test_a_second_python_that_dies_is_replaced_by_this_one() -> None:
    with Beside(_die_elsewhere, os.getpid()) as task:
        assert task.result() == "alive"


def _die_elsewhere(home: int) -> str:
    if os.getpid() != home:
        os._exit(3)
    return "alive"
