"""diagnose: which assumptions of the experiment hold, which fail, where, and what the record cannot tell.

Every finding names its sentence by `words_key`; `words_values` hold the numbers in it (SI, shares as fractions):

    small_angle.fails                   amplitude_above_rad t_start_s t_stop_s amplitude_max_rad period_shift difference_rad sigmas
    small_angle.holds                   amplitude_max_rad period_shift amplitude_visible_rad difference_rad
    small_angle.not_distinguishable     the same, delta_chi2 omega_g_bias_sigma
    small_angle.contradicted            delta_chi2 growth growth_u amplitude_max_rad
    small_angle.no_fit
    linear_drag.fails                   amplitude_above_rad share amplitude_max_rad visible_share sigmas [t_start_s t_stop_s]
    linear_drag.fails.throughout        as linear_drag.fails: at every swing
    linear_drag.fails.friction          amplitude_below_rad share amplitude_min_rad visible_share sigmas [t_start_s t_stop_s]
    linear_drag.fails.friction.throughout   as linear_drag.fails.friction: at every swing
    linear_drag.holds                   share_bound delta_chi2 amplitude_max_rad amplitude_min_rad
    linear_drag.not_distinguishable.little_decay, .noise
                                        delta_chi2 delta_chi2_quadratic_alone decay
    linear_drag.no_fit
    white_residuals.holds               rho1
    white_residuals.fails               rho1 inflation frequency_hz strongest_over_swing
    white_residuals.too_few             points
    clock.holds
    clock.repeated                      frames t_start_s
    clock.jump                          t_start_s jump_s
    clock.rate                          t_start_s rate_change
    clock.not_distinguishable           t_start_s share
    geometry.holds, .scale, .pivots, .or_clock, .not_distinguishable
                                        scale scale_u pivots_sigma
    frictionless_pivot.holds            share_bound
    frictionless_pivot.fails            share share_at_end sigmas
    frictionless_pivot.not_distinguishable   share_bound delta_chi2
    no_drive.holds, .fails, .slow, .not_distinguishable
                                        frequency_hz amplitude_rad over_swing
    taut_string.holds                   tension_over_weight amplitude_max_rad
    taut_string.fails                   the same, t_start_s t_stop_s amplitude_above_rad slack_share
"""

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
