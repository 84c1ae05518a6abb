"""Is there friction at the pivot that does not depend on speed? It takes 2τ·2A from every half swing: the amplitude then
falls by equal steps and not by equal factors."""

from __future__ import annotations

import math

import numpy as np

from toolkit.checks.evidence import FAILS_BELOW_P, Evidence, boundary_p, omega_g_of, sigmas
from toolkit.checks.finding import FAILS, HOLDS, NOT_DISTINGUISHABLE, Finding

_LARGEST_SHARE = 0.35


def check(evidence: Evidence) -> Finding | None:
    """`fails` where a constant friction torque improves on linear and quadratic drag beyond chance; `holds` where it gains
    nothing and could take at most a third of the loss at the mean amplitude."""
    without = evidence.fit("full_linear_quadratic_drag")
    friction = evidence.fit("full_linear_quadratic_coulomb")
    if not (without.success and friction.success):
        return None
    gain = evidence.chi2(without) - evidence.chi2(friction)
    p_value = boundary_p(gain, 1)
    table = {**friction.derived, **friction.parameters}
    name = "torque" if "torque" in friction.parameters else "mu"
    mu, omega = table["mu"].value, omega_g_of(friction)
    amplitude = evidence.amplitude()
    mean, smallest = float(np.mean(amplitude)), float(np.min(amplitude))
    alpha, beta = (table[n].value if n in table else 0.0 for n in ("alpha_d", "beta"))

    def share(torque: float, at: float) -> float:
        rate = 2 * torque / (math.pi * omega * max(at, 1e-9))
        total = alpha + 4 / (3 * math.pi) * beta * omega * at + 2 * mu / (math.pi * omega * max(at, 1e-9))
        return min(rate / total, 1.0) if total > 0 else 0.0

    u = table["mu"].stderr if table.get("mu") is not None else None
    bound = share(mu + 1.645 * u, mean) if u is not None else 1.0
    numbers = {
        "delta_chi2": gain,
        "p_value": p_value,
        "mu_per_s2": mu,
        "friction_share_mean": share(mu, mean),
        "friction_share_bound_95": bound,
    }
    if name == "torque":
        numbers["torque_n_m"] = friction.parameters["torque"].value
    strength = sigmas(p_value)
    if p_value < FAILS_BELOW_P:
        at_end = share(mu, smallest)
        stop = math.pi * omega / (2 * mu) * smallest if mu > 0 else math.inf
        return Finding(
            "frictionless_pivot",
            FAILS,
            where={"amplitude_below_rad": float(np.max(amplitude))},
            evidence={**numbers, "friction_share_at_end": at_end, "stops_after_s": stop},
            sentence=(
                f"There is friction at the pivot ({strength:.0f} sigma): it takes {100 * share(mu, mean):.0f} % of the energy lost on the "
                f"whole and {100 * at_end:.0f} % at the smallest swing."
            ),
            remedy="let the string hang from a sharp edge or clamp it; keep pivot friction in the model",
            strength_sigma=strength,
            words_key="frictionless_pivot.fails",
            words_values={"share": share(mu, mean), "share_at_end": at_end, "sigmas": strength},
        )
    if gain < 4 and bound < _LARGEST_SHARE:
        return Finding(
            "frictionless_pivot",
            HOLDS,
            evidence=numbers,
            sentence=f"No friction at the pivot is seen: at most {100 * bound:.0f} % of the loss could be due to it.",
            words_key="frictionless_pivot.holds",
            words_values={"share_bound": bound},
        )
    return Finding(
        "frictionless_pivot",
        NOT_DISTINGUISHABLE,
        evidence=numbers,
        sentence=f"This record cannot tell whether the pivot rubs (Δχ² = {gain:.1f}): friction could take up to {100 * bound:.0f} % of the loss.",
        remedy="record the last, small swings too: friction shows there",
        strength_sigma=strength,
        words_key="frictionless_pivot.not_distinguishable",
        words_values={"share_bound": bound, "delta_chi2": gain},
    )
