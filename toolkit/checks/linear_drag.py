"""Is the drag proportional to the speed? Only models with the full sine are compared: a large swing's amplitude falls
faster than exponentially even under linear drag (physics: −A'/γA = 1 + 5A²/96 …), which small angles mistake for v²."""

from __future__ import annotations

import math

import numpy as np

from toolkit.checks.evidence import FAILS_BELOW_P, Evidence, boundary_p, omega_g_of, sigmas
from toolkit.checks.finding import FAILS, HOLDS, NOT_DISTINGUISHABLE, Finding

_QUADRATIC_REJECTED = 9.0
_LARGEST_SHARE = 0.35
_VISIBLE_SHARE = 0.1


def check(evidence: Evidence) -> Finding:
    """`fails` where v² drag or pivot friction beside it improves the fit beyond chance; `holds` where linear drag
    suffices, quadratic drag alone does not, and the share of the loss that could be quadratic is bounded."""
    linear = evidence.fit("full_linear_drag")
    both = evidence.fit("full_linear_quadratic_drag")
    quadratic = evidence.fit("full_quadratic_drag")
    others = [both, *(evidence.fits[n] for n in ("full_linear_quadratic_coulomb",) if n in evidence.fits)]
    if not (linear.success and any(r.success for r in others)):
        return Finding(
            "linear_drag",
            NOT_DISTINGUISHABLE,
            sentence="The fits that decide between linear and quadratic drag did not converge, so nothing is said.",
            remedy=linear.message if not linear.success else both.message,
            words_key="linear_drag.no_fit",
        )
    chances = []
    for result in others:
        if result.success:
            gain = evidence.chi2(linear) - evidence.chi2(result)
            chances.append((boundary_p(gain, 1 if result is both else 2), gain, result))
    p_value, gain, best = min(chances, key=lambda c: c[0])
    over_quadratic = evidence.chi2(quadratic) - evidence.chi2(linear) if quadratic.success else math.nan
    amplitude = evidence.amplitude()
    largest, smallest = float(np.max(amplitude)), float(np.min(amplitude))
    loss = _Loss(best, evidence)
    share_mean, share_bound = _share_bound(both, evidence)
    numbers = {
        "delta_chi2": gain,
        "delta_aic": gain - 2 * (len(best.free) - len(linear.free)),
        "p_value": p_value,
        "delta_chi2_quadratic_alone": over_quadratic,
        "quadratic_share_at_start": loss.quadratic_share(largest),
        "friction_share_at_start": loss.friction_share(largest),
        "quadratic_share_mean": share_mean,
        "quadratic_share_bound_95": share_bound,
        "inflation": math.sqrt(evidence.inflation2),
    }
    strength = sigmas(p_value)
    if p_value < FAILS_BELOW_P:
        return _fails(evidence, loss, numbers, strength, amplitude)
    if gain < 4 and over_quadratic > _QUADRATIC_REJECTED and share_bound < _LARGEST_SHARE:
        values = {
            "share_bound": share_bound,
            "delta_chi2": over_quadratic,
            "amplitude_max_rad": largest,
            "amplitude_min_rad": smallest,
        }
        return Finding(
            "linear_drag",
            HOLDS,
            evidence=numbers,
            sentence=(
                f"Linear drag describes this record: adding a v² term gains nothing, v² drag alone fits worse by "
                f"Δχ² = {over_quadratic:.0f}, and at most {100 * share_bound:.0f} % of the loss could be quadratic."
            ),
            strength_sigma=math.sqrt(max(over_quadratic, 0.0)),
            words_key="linear_drag.holds",
            words_values=values,
        )
    decay = 1 - float(amplitude[-1]) / largest if largest > 0 else 0.0
    return Finding(
        "linear_drag",
        NOT_DISTINGUISHABLE,
        evidence=numbers,
        sentence=(
            f"This record cannot tell linear from quadratic drag (Δχ² = {gain:.1f} for both together, "
            f"{over_quadratic:.1f} for quadratic alone): the swing lost only {100 * decay:.0f} % of its amplitude."
            if decay < 0.3
            else f"This record cannot tell linear from quadratic drag (Δχ² = {gain:.1f} for both together, "
            f"{over_quadratic:.1f} for quadratic alone): the noise hides the difference."
        ),
        remedy="record until the swing has halved, start from a larger angle, or use a lighter bob",
        strength_sigma=strength,
        words_key="linear_drag.not_distinguishable.little_decay"
        if decay < 0.3
        else "linear_drag.not_distinguishable.noise",
        words_values={"delta_chi2": gain, "delta_chi2_quadratic_alone": over_quadratic, "decay": decay},
    )


def _fails(
    evidence: Evidence, loss: _Loss, numbers: dict[str, float], strength: float, amplitude: np.ndarray
) -> Finding:
    t = evidence.series.t_s
    largest = float(np.max(amplitude))
    quadratic, friction = loss.quadratic_share(largest), loss.friction_share(float(np.min(amplitude)))
    where: dict[str, float]
    if quadratic >= friction or loss.mu == 0:
        visible = min(_VISIBLE_SHARE, quadratic / 2)
        threshold = min(max(loss.amplitude_of_share(visible), float(np.min(amplitude))), largest)
        inside = amplitude >= threshold
        where = {"amplitude_above_rad": threshold, "amplitude_equal_loss_rad": loss.amplitude_of_share(0.5)}
        throughout = bool(inside.all())
        there = "at every swing of this record" if throughout else _angle("above", threshold)
        sentence = (
            f"Linear drag fails ({strength:.0f} sigma): {there} more than {100 * visible:.2g} % of the energy loss goes as v²; "
            f"at the largest swing, {largest:.3g} rad, it is {100 * quadratic:.0f} %."
        )
        key, remedy = "linear_drag.fails", "use the model with linear and quadratic drag"
        values = {
            "amplitude_above_rad": threshold,
            "share": quadratic,
            "amplitude_max_rad": largest,
            "visible_share": visible,
            "sigmas": strength,
        }
    else:
        visible = min(_VISIBLE_SHARE, friction / 2)
        threshold = min(loss.amplitude_of_friction_share(visible), largest)
        inside = amplitude <= threshold
        where = {"amplitude_below_rad": threshold}
        throughout = bool(inside.all())
        there = "at every swing of this record" if throughout else _angle("below", threshold)
        sentence = (
            f"Linear drag fails ({strength:.0f} sigma): {there} more than {100 * visible:.2g} % of the energy loss is friction at "
            f"the pivot, which does not depend on speed; at the smallest swing it is {100 * friction:.0f} %."
        )
        key, remedy = (
            "linear_drag.fails.friction",
            "use the model with pivot friction; let the string hang from a sharp edge",
        )
        values = {
            "amplitude_below_rad": threshold,
            "share": friction,
            "amplitude_min_rad": float(np.min(amplitude)),
            "visible_share": visible,
            "sigmas": strength,
        }
    if inside.any():
        where |= {"t_start_s": float(t[inside][0]), "t_stop_s": float(t[inside][-1])}
        values |= {"t_start_s": where["t_start_s"], "t_stop_s": where["t_stop_s"]}
    return Finding(
        "linear_drag",
        FAILS,
        where=where,
        evidence=numbers,
        sentence=sentence,
        remedy=remedy,
        strength_sigma=strength,
        words_key=f"{key}.throughout" if throughout else key,
        words_values=values,
    )


def _angle(side: str, threshold: float) -> str:
    return f"{side} {threshold:.3g} rad ({math.degrees(threshold):.2g}°)"


class _Loss:
    """Equivalent damping rates of a fit, 1/s, as functions of amplitude: α, (4/3π) β ω A and 2μ/(π ω A)."""

    def __init__(self, result, evidence: Evidence) -> None:  # type: ignore[no-untyped-def]
        self.omega = omega_g_of(result)
        table = {**result.derived, **result.parameters}
        self.alpha, self.beta, self.mu = (table[n].value if n in table else 0.0 for n in ("alpha_d", "beta", "mu"))

    def _parts(self, amplitude: float) -> tuple[float, float, float]:
        a = max(amplitude, 1e-9)
        return self.alpha, 4 / (3 * math.pi) * self.beta * self.omega * a, 2 * self.mu / (math.pi * self.omega * a)

    def quadratic_share(self, amplitude: float) -> float:
        linear, quadratic, friction = self._parts(amplitude)
        total = linear + quadratic + friction
        return quadratic / total if total > 0 else 0.0

    def friction_share(self, amplitude: float) -> float:
        linear, quadratic, friction = self._parts(amplitude)
        total = linear + quadratic + friction
        return friction / total if total > 0 else 0.0

    def amplitude_of_share(self, share: float) -> float:
        """Amplitude at which v² drag takes `share` of what linear and quadratic drag take together."""
        if self.beta <= 0:
            return math.pi
        return min(share / (1 - share) * self.alpha * 3 * math.pi / (4 * self.beta * self.omega), math.pi)

    def amplitude_of_friction_share(self, share: float) -> float:
        """Amplitude at which pivot friction takes `share` of what it and linear drag take together."""
        if self.alpha <= 0:
            return math.pi
        return min((1 - share) / share * 2 * self.mu / (math.pi * self.omega * self.alpha), math.pi)


def _share_bound(both, evidence: Evidence) -> tuple[float, float]:  # type: ignore[no-untyped-def]
    """Share of the loss that is quadratic at the mean amplitude: as fitted, and at most (95 %)."""
    name = "c" if "c" in both.parameters else "beta"
    fitted = both.parameters[name]
    loss = _Loss(both, evidence)
    mean = float(np.mean(evidence.amplitude()))
    total = sum(loss._parts(mean))
    per_unit = 4 / (3 * math.pi) * loss.omega * mean * ((loss.beta / fitted.value) if fitted.value else _factor(both))
    if not total > 0 or fitted.stderr is None:
        return 0.0, 1.0
    return fitted.value * per_unit / total, min((fitted.value + 1.645 * fitted.stderr) * per_unit / total, 1.0)


def _factor(both) -> float:  # type: ignore[no-untyped-def]
    """β for one unit of the fitted coefficient, from their standard uncertainties (the coefficient itself is zero)."""
    if "beta" in both.parameters:
        return 1.0
    u, u_beta = both.parameters["c"].stderr, both.derived["beta"].stderr if "beta" in both.derived else None
    return u_beta / u if u and u_beta else math.nan
