"""Where the shipped sample recordings are."""

from __future__ import annotations

from pathlib import Path

from toolkit.errors import JobError


def sample(name: str) -> Path:
    """The path of a shipped sample file (see data/samples/README.md). Raises JobError if it is not there."""
    package = Path(__file__).resolve().parent
    for folder in (package / "samples", package.parent / "data" / "samples"):
        if (folder / name).is_file():
            return folder / name
    raise JobError(f"the sample {name} is not installed; install pendulab again")
