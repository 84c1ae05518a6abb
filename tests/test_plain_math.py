"""Formulas in a terminal: what a person would write, and no sign of LaTeX left."""

from __future__ import annotations

import pytest

from toolkit.effects import effect_names
from toolkit.models import load_model, model_names
from toolkit.motion import build_equation
from toolkit.report.plain_math import plain_math


@pytest.mark.parametrize(
    ("latex", "plain"),
    [
        (
            r"m \ell^{2}\,\ddot\theta = -m g \ell \sin \theta - k_d \ell^{2} \dot\theta",
            "m ℓ² θ̈ = −m g ℓ sin θ − k_d ℓ² θ̇",
        ),
        (r"c \ell^{3} |\dot\theta| \dot\theta", "c ℓ³ |θ̇| θ̇"),
        (r"\tau \operatorname{sgn}\left(\dot\theta\right)", "τ sgn(θ̇)"),
        (r"\frac{4}{3} \pi r^{3}", "4/3 π r³"),
        (r"\frac{a + b}{c d}", "(a + b)/(c d)"),
        (r"\frac{{\left(m g\right)}^{2}}{k}", "(m g)²/k"),
        (r"\frac{r}{\sqrt{\frac{g}{\ell}}}", "r/(√(g/ℓ))"),
        (r"\sqrt{x}", "√x"),
        (r"{\left(\ell - r\right)}^{\frac{10}{3}}", "(ℓ − r)^(10/3)"),
        (r"x^{-2} f_0 m_s", "x⁻² f₀ mₛ"),
        (r"{|\dot\theta|}^{0.677}", "|θ̇|^0.677"),
    ],
)
def test_what_a_person_would_write(latex, plain):
    assert plain_math(latex) == plain


def test_every_equation_has_letters_for_all():
    """Brackets close, and no command or brace is left."""
    formulas = {"formula": "-k*omega"}
    of_effects = [build_equation((n,), formulas=formulas if n == "formula" else {}).latex for n in effect_names()]
    for latex in of_effects + [load_model(name).latex for name in model_names()]:
        plain = plain_math(latex)
        assert not set("\\{}") & set(plain)
        assert plain.count("(") == plain.count(")")
        assert "theta" not in plain
