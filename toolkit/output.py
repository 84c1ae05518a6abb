"""Output that appears whole or not at all: written beside its place, then moved there."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from toolkit.errors import UsageError


@contextmanager
def whole_folder(folder: str | Path) -> Iterator[Path]:
    """Yield an empty scratch folder; when the block ends well, move all that it holds into `folder`.

    `folder` is made if need be; files of the same name in it are replaced, others are left alone. When the
    block raises, nothing of it remains. Raises UsageError if `folder` is a file or cannot be written.
    """
    folder = Path(folder)
    if folder.exists() and not folder.is_dir():
        raise UsageError(f"{folder} is a file; --out needs a folder: give another name")
    missing = [p for p in (folder, *folder.parents) if not p.exists()]
    scratch: Path | None = None
    done = False
    try:  # from here on, so that a Ctrl-C while the folder is being made leaves nothing either
        try:
            folder.mkdir(parents=True, exist_ok=True)
            scratch = Path(tempfile.mkdtemp(prefix=".unfinished-", dir=folder))
        except OSError as error:
            raise UsageError(f"cannot write into {folder}: {error.strerror}; choose another folder") from error
        yield scratch
        _move_all(scratch, folder)
        done = True
    finally:
        if scratch is not None:
            shutil.rmtree(scratch, ignore_errors=True)
        if not done:
            for made in missing:  # innermost first: only folders that this call made, and only if still empty
                try:
                    made.rmdir()
                except OSError:
                    break


class _OnlyTried(Exception):
    pass


def try_folder(folder: str | Path) -> None:
    """Raise UsageError where `whole_folder` would, before long work is done for it; nothing of the attempt remains."""
    with suppress(_OnlyTried), whole_folder(folder):
        raise _OnlyTried


def _move_all(source: Path, target: Path) -> None:
    for item in sorted(source.iterdir()):
        destination = target / item.name
        if item.is_dir():
            destination.mkdir(exist_ok=True)
            _move_all(item, destination)
        elif destination.is_dir():
            raise UsageError(f"{destination} is a folder; give a file name")
        else:
            os.replace(item, destination)


@contextmanager
def whole_file(path: str | Path) -> Iterator[Path]:
    """Yield a scratch path with the same suffix; when the block ends well, move it to `path`.

    Raises UsageError if `path` is a folder or its folder cannot be written.
    """
    path = Path(path)
    if path.is_dir():
        raise UsageError(f"{path} is a folder; give a file name")
    with whole_folder(path.parent) as scratch:
        yield scratch / path.name
