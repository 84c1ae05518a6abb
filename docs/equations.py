"""A hook of the site's build: displayed formulas become drawings, so that the site needs no script and no network."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

_ROOT = str(Path(__file__).resolve().parents[1])


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Every `$$` block as an SVG in the text's own colour; as LaTeX where it cannot be set."""
    if _ROOT not in sys.path:  # the builder forgets what is added while this file is loaded
        sys.path.insert(0, _ROOT)
    return re.sub(r"^\$\$\n(.*?)\n\$\$$", _drawn, markdown, flags=re.MULTILINE | re.DOTALL)


def _drawn(found: re.Match[str]) -> str:
    from toolkit.report.style import INK, formula

    svg = formula(found[1], found[1]).replace(INK, "currentColor").replace("\n", "")
    if not svg:
        return f"```text\n{found[1]}\n```"
    return f'<p style="overflow-x:auto" role="math">{svg}</p>'
