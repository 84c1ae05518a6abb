"""pendulab's toolkit: from a video of a pendulum to fitted models and a report.

All that is public is importable from here; each name is loaded when it is first used.
"""

from __future__ import annotations

import importlib
import sys
from types import ModuleType
from typing import Any

__version__ = "0.1.0"

_HOME = {
    "Analysis": "analyse",
    "Camera": "scene",
    "Environment": "scene",
    "FitResult": "fit",
    "FittedParameter": "fit",
    "Finding": "checks.finding",
    "JobError": "errors",
    "Pendulum": "scene",
    "PendulabError": "errors",
    "Release": "scene",
    "Scene": "scene",
    "ThetaSeries": "series",
    "Track": "track",
    "Trajectory": "trajectory",
    "UsageError": "errors",
    "analyse": "analyse",
    "build_report": "report",
    "calibrate": "calibrate",
    "diagnose": "diagnose",
    "fit": "fit",
    "fit_models": "fit",
    "make_report": "make_report",
    "open_video": "video",
    "read_series": "series_io",
    "render": "render",
    "simulate": "simulate",
    "track": "track",
    "write_report": "report",
    "write_series": "series_io",
}

__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'toolkit' has no attribute {name!r}")
    value = getattr(importlib.import_module(f"toolkit.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return [*__all__, "__version__"]


class _Toolkit(ModuleType):
    """Importing `toolkit.track` would bind that module over the function `toolkit.track`: the function stays."""

    def __setattr__(self, name: str, value: Any) -> None:
        if not (name in _HOME and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Toolkit
