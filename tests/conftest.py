"""What all tests share."""

from __future__ import annotations

from pathlib import Path

import pytest

_RECORDINGS = Path(__file__).resolve().parents[2] / "shared" / "data"


@pytest.fixture
def shared_data() -> Path:
    """The folder of real recordings that stands beside the project; tests that need it skip where it is absent."""
    if not _RECORDINGS.is_dir():
        pytest.skip("the real recordings (../shared/data) are not on this machine")
    return _RECORDINGS
