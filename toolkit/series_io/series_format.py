"""What a format of θ(t) files is, and the first look at a file that decides which format it has."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from toolkit.errors import JobError
from toolkit.series import ThetaSeries

MAX_BYTES = 200_000_000
_HEAD_BYTES = 65_536


@dataclass(frozen=True)
class Look:
    """The beginning of a file: `head` as bytes, `text` decoded ("" for a binary file)."""

    path: Path
    head: bytes
    text: str

    @property
    def lines(self) -> list[str]:
        """The first lines that are not empty."""
        return [line for line in self.text.splitlines() if line.strip()]


@dataclass(frozen=True)
class SeriesFormat:
    """One format. `recognises` looks at the beginning; formats are asked by rising `order`.

    `write` is None for a format that is only read. `meaning` is one line for the documentation.
    """

    name: str
    suffixes: tuple[str, ...]
    meaning: str
    recognises: Callable[[Look], bool]
    read: Callable[[Path], ThetaSeries]
    write: Callable[[ThetaSeries, Path], None] | None = None
    order: int = 50


def peek(path: Path) -> Look:
    """The beginning of the file. Raises JobError where it is missing, a folder, empty, unreadable or too large."""
    if path.is_dir():
        raise JobError(f"{path} is a folder; give a file with θ(t)")
    try:
        size = path.stat().st_size
        with path.open("rb") as file:
            head = file.read(_HEAD_BYTES)
    except OSError as error:
        raise JobError(f"cannot read {path}: {error.strerror}; check the file's name") from error
    if not head:
        raise JobError(f"{path} is empty; export θ(t) again")
    if size > MAX_BYTES:
        raise JobError(
            f"{path} has {size / 1e6:.0f} MB, more than the {MAX_BYTES / 1e6:.0f} MB that are read; cut the record"
        )
    return Look(path, head, decode(head) or "")


def decode(data: bytes) -> str | None:
    """Text in UTF-8 or UTF-16 (with its mark), else Windows-1252; None for binary data."""
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return data.decode("utf-16", errors="replace")
    if b"\0" in data:
        return None
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        if len(data) - error.start < 4:  # a look may cut the last letter
            return data.decode("utf-8-sig", errors="ignore")
        text = data.decode("cp1252", errors="replace")
        strange = sum(c == "\ufffd" or (c < " " and c not in "\t\r\n\f") for c in text)
        return None if strange > 0.01 * len(text) else text
