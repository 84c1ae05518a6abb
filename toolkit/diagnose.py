"""diagnose: which assumptions of the experiment hold, which fail, where, and what the record cannot tell."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from toolkit.errors import UsageError

if TYPE_CHECKING:
    from toolkit.checks.finding import Finding
    from toolkit.fit import FitResult
    from toolkit.scene import Scene
    from toolkit.series import ThetaSeries

FIRST = ("small_angle", "linear_drag")
"""The two verdicts that every report has."""


def diagnose(series: ThetaSeries, fits: Mapping[str, FitResult], scene: Scene | None = None) -> list[Finding]:
    """All findings on a record: `small_angle` and `linear_drag` always and first, then the other checks that apply.

    `fits` as `fit_models` returns them; a check that needs one more model fits it. Raises UsageError without fits.
    """
    from toolkit.checks import check_names, load_check
    from toolkit.checks.evidence import Evidence
    from toolkit.fit import choose_model
    from toolkit.scene import Scene

    if not fits:
        raise UsageError("diagnose needs at least one fit; call fit_models first")
    evidence = Evidence(series, fits, scene or Scene(), choose_model(fits))
    names = [*FIRST, *(name for name in check_names() if name not in FIRST)]
    found = (load_check(name)(evidence) for name in names)
    return [finding for finding in found if finding is not None]
