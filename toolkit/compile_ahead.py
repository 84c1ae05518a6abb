"""Compile the ladder's equations on another processor while a video is being tracked, the first time only."""

from __future__ import annotations

import sys
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path

from toolkit.beside import Beside


def compile_ahead() -> AbstractContextManager[Beside | None]:
    """Start to fit every model of the ladder to a made-up swing elsewhere, so that their code is on the disk.

    None is inside where that was done before by these versions. Ask for the result before fitting: what is compiled
    there need not be compiled twice.
    """
    return nullcontext() if _mark().exists() else Beside(fit_a_made_up_swing)


def fit_a_made_up_swing() -> None:
    """Fit and judge a short noisy swing with all kinds of drag: whatever a report compiles is then compiled."""
    import numpy as np

    from toolkit.diagnose import diagnose
    from toolkit.fit import fit_models
    from toolkit.series import ThetaSeries

    t_s = np.arange(0, 6, 1 / 60)
    theta_rad = 0.6 * np.exp(-0.05 * t_s) * np.cos(4.6 * t_s) + np.random.default_rng(0).normal(0, 1e-3, t_s.size)
    series = ThetaSeries(t_s, theta_rad, np.full(t_s.size, 1e-3))
    diagnose(series, fit_models(series))
    _mark().touch()


def _mark() -> Path:
    from importlib.metadata import version

    from toolkit.motion.compiled import cache_folder, key_of

    package = Path(__file__).resolve().parent
    texts = [
        file.read_bytes() for room in ("motion", "models", "effects") for file in sorted((package / room).rglob("*.py"))
    ]
    return cache_folder() / f"ready-{key_of(version('numba'), version('numpy'), sys.version, *texts)}"
