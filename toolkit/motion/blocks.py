"""Long arrays in pieces: a dozen temporary arrays of a piece stay in the cache, where those of the whole do not."""

from __future__ import annotations

from collections.abc import Iterator

_BLOCK = 4096


def blocks(count: int) -> Iterator[slice]:
    """Slices that together cover 0 … count."""
    return (slice(start, min(start + _BLOCK, count)) for start in range(0, count, _BLOCK))
