"""What `from toolkit import …` offers."""

from __future__ import annotations

import importlib
import inspect
import subprocess
import sys

import pytest

import toolkit


@pytest.mark.parametrize("name", toolkit.__all__)
def test_every_public_name_loads_and_is_documented(name):
    value = getattr(toolkit, name)
    assert inspect.getdoc(value), f"{name} has no docstring"
    assert not inspect.ismodule(value)


def test_a_function_keeps_its_name_after_its_module_was_imported():
    module = importlib.import_module("toolkit.track")
    assert inspect.ismodule(module)
    assert callable(toolkit.track)


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="nothing_of_ours"):
        toolkit.nothing_of_ours  # noqa: B018


def imported_by(code: str) -> set[str]:
    script = f"import sys\n{code}\nprint(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    return set(done.stdout.split())


HEAVY = {"cv2", "av", "numba", "sympy", "matplotlib", "lmfit", "pandas", "scipy", "typst", "jinja2"}


def test_help_imports_nothing_heavy():
    loaded = imported_by(
        "import cli, contextlib\nwith contextlib.redirect_stdout(None):\n cli.app(['--help'], standalone_mode=False)"
    )
    assert not loaded & (HEAVY | {"numpy"})


def test_the_nouns_import_nothing_heavy():
    loaded = imported_by("from toolkit import Scene, ThetaSeries, Track, Trajectory, FitResult, Finding")
    assert not loaded & HEAVY
