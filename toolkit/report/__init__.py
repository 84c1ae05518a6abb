"""One Report value, several writers: `build_report(analysis)`, then `write_report(report, folder, formats)`."""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from toolkit.report.document import Report

_WRITERS = {"html": "html", "pdf": "pdf", "tex": "latex", "md": "markdown", "xlsx": "xlsx"}
FORMATS = tuple(_WRITERS)


def check_choice(formats: Sequence[str], lang: str) -> None:
    """Raises UsageError for a format or a language that there is not."""
    from toolkit.errors import UsageError
    from toolkit.registry import did_you_mean
    from toolkit.report.words import load_words

    if not formats:
        raise UsageError(f"no report format is named; choose from {', '.join(FORMATS)}")
    for name in formats:
        if name not in _WRITERS:
            raise UsageError(f"unknown report format {name!r}{did_you_mean(name, FORMATS)}")
    load_words(lang)


def import_ahead(formats: Sequence[str]) -> None:
    """Import what figures and writers need beside the measuring, which mostly waits for decoders and machine code."""
    from threading import Thread

    needed = ["toolkit.report.build", "matplotlib.backends.backend_svg", "matplotlib.font_manager"]
    needed += [name for kind, name in (("html", "jinja2"), ("pdf", "typst")) if kind in formats]

    def import_all() -> None:
        for name in needed:
            importlib.import_module(name)

    Thread(target=import_all, daemon=True).start()


def build_report(analysis: Any, lang: str = "en") -> Report:
    """All that the report says, with its figures drawn. Raises UsageError for an unknown language."""
    from toolkit.report.build import build

    return build(analysis, lang)


def write_report(report: Report, folder: str | Path, formats: Sequence[str] = ("html", "pdf")) -> list[Path]:
    """Write report.html, report.pdf, report.tex, report.md, report.xlsx (and figures/) into `folder`.

    Returns the paths of the reports, in the order asked for. Raises UsageError for an unknown format.
    """
    check_choice(formats, report.words.lang)
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    return [importlib.import_module(f"toolkit.report.{_WRITERS[name]}").write(report, folder) for name in formats]
