"""Run a function in a second Python beside this one: for work that would wait for this one's interpreter lock."""

from __future__ import annotations

import contextlib
import pickle
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

# What the function prints must not get into its answer.
_CHILD = """
import sys
said, sys.stdout = sys.stdout.buffer, sys.stderr
sys.path.insert(0, {root!r})
from toolkit.beside import answer
answer(sys.stdin.buffer, said)
"""


class Beside:
    """A call of `function(*args)` that has been started elsewhere. A context manager: leaving it early stops the call.

    Function and arguments must be picklable, so the function is one that a module holds. Where no second Python can be
    started, the call is made here when its result is asked for.
    """

    def __init__(self, function: Callable[..., Any], *args: Any) -> None:
        self._call, self._process = (function, args), _start()
        if self._process is not None and self._process.stdin is not None:
            with contextlib.suppress(OSError), self._process.stdin as pipe:  # a child that died says so in its answer
                pipe.write(pickle.dumps(self._call))

    def result(self) -> Any:
        """What the function returned; raises what it raised. Waits for it."""
        function, args = self._call
        if self._process is None or self._process.stdout is None:
            return function(*args)
        with self._process.stdout as pipe:
            said = pipe.read()
        if self._process.wait() != 0 or not said:
            return function(*args)  # the other Python could not: a missing module, too little memory
        fine, value = pickle.loads(said)  # written by our own child, through a pipe that nobody else holds
        if not fine:
            raise value
        return value

    def __enter__(self) -> Beside:
        return self

    def __exit__(self, *_: object) -> None:
        if self._process is not None and self._process.poll() is None:
            self._process.kill()
            self._process.wait()


def answer(asked: Any, said: Any) -> None:
    """In the second Python: make the call that is pickled in `asked`, pickle (fine, value or exception) into `said`."""
    function, args = pickle.loads(asked.read())  # read first: the asker waits until all is out of its hands
    try:
        outcome = (True, function(*args))
    except Exception as error:
        outcome = (False, error)
    said.write(pickle.dumps(outcome))
    said.flush()


def _start() -> subprocess.Popen[bytes] | None:
    if not sys.executable or getattr(sys, "frozen", False):
        return None
    code = _CHILD.format(root=str(Path(__file__).resolve().parents[1]))
    pipe, quiet = subprocess.PIPE, subprocess.DEVNULL
    try:
        return subprocess.Popen([sys.executable, "-c", code], stdin=pipe, stdout=pipe, stderr=quiet)
    except OSError:
        return None
