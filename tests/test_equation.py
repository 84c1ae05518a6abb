"""The equation: what is read, what is generated, what is kept on disk."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest

from toolkit.errors import UsageError
from toolkit.motion import build_equation

P = {
    "mass_kg": 0.25,
    "length_m": 0.5,
    "g_m_per_s2": 9.8,
    "linear_drag.k_d_kg_per_s": 0.16,
    "quadratic_drag.c_kg_per_m": 1e-3,
}
P |= {
    "cosine_drive.f0_n": 0.15,
    "cosine_drive.f_hz": 0.15,
    "cosine_drive.phase_rad": 0.4,
    "pivot_friction.torque_n_m": 1e-3,
}
ALL = ["linear_drag", "quadratic_drag", "cosine_drive", "pivot_friction"]


def test_order_of_the_effects_does_not_matter():
    assert build_equation(["linear_drag", "cosine_drive"]) is build_equation(["cosine_drive", "linear_drag"])


def test_parameters_are_those_of_the_active_effects():
    assert build_equation().parameters == ("length_m", "g_m_per_s2")
    assert build_equation(["linear_drag"]).parameters == (
        "length_m",
        "g_m_per_s2",
        "mass_kg",
        "linear_drag.k_d_kg_per_s",
    )


def test_latex_reads_like_the_paper():
    latex = build_equation(["linear_drag", "cosine_drive"], small_angle=True).latex
    for piece in (r"\ddot\theta", "k_d", "f_0", r"\varphi_f", r"\theta"):
        assert piece in latex
    assert r"\sin" not in latex
    assert r"\sin \theta" in build_equation().latex


def test_is_linear():
    assert build_equation(["linear_drag", "cosine_drive", "buoyancy"], small_angle=True).is_linear
    assert not build_equation(["linear_drag"]).is_linear
    assert not build_equation(["quadratic_drag"], small_angle=True).is_linear


@pytest.mark.parametrize("names", [[], ["linear_drag"], ["quadratic_drag", "pivot_friction"], ALL])
def test_generated_code_is_the_equation(names):
    """Basis and coefficients of the generated source, put together, are torque/inertia of the terms themselves."""
    equation = build_equation(names)
    code, scale = equation.code, 0.25
    p = [P[n] for n in equation.parameters]
    q = code.coefficients(p, scale)
    rng = np.random.default_rng(1)
    for t, theta, omega in rng.uniform(-2, 2, (10, 3)):
        basis = [0.0] * code.N_BASIS
        code.terms(q, (t / scale, theta, omega * scale, np.sign(omega)), basis)
        made = sum(q[code.N_INNER + i] * basis[column] for i, column in enumerate(code.ROWS[0]))
        motion = equation.terms_at(P, t, theta, omega)
        assert made == pytest.approx(scale**2 * motion.torque / motion.inertia, rel=1e-12, abs=1e-14)


def test_source_of_the_bare_pendulum_holds_nothing_else():
    source = build_equation().source
    assert source.count("\n") < 100
    for word in ("drag", "drive", "friction", "mass_kg", "abs(", "W[192"):
        assert word not in source


def test_sensitivities_in_any_subset_and_order():
    equation, t = build_equation(ALL), np.linspace(0, 3, 7)
    names = [*P, "theta0_rad", "omega0_rad_per_s"]
    whole = equation.solve(P, 0.8, 0.1, t, 1e-11, names)
    for some in (["theta0_rad"], ["cosine_drive.f_hz", "mass_kg"], names[::-1]):
        part = equation.solve(P, 0.8, 0.1, t, 1e-11, some)
        for i, name in enumerate(some):
            np.testing.assert_allclose(part.d_theta[:, i], whole.d_theta[:, names.index(name)], atol=1e-9)
            np.testing.assert_allclose(part.d_omega[:, i], whole.d_omega[:, names.index(name)], atol=1e-8)


def test_closed_form_sensitivities_equal_integrated_ones():
    equation = build_equation(["linear_drag", "cosine_drive", "buoyancy"], small_angle=True)
    p = {**P, "bob_radius_m": 0.05, "fluid_density_kg_per_m3": 1.2}
    names = ("theta0_rad", "omega0_rad_per_s", *equation.parameters)
    t = np.linspace(0, 5, 11)
    exact = equation.solve(p, 0.3, 0.2, t, 1e-12, names)
    assert "closed form" in exact.method
    values = tuple(p[n] for n in equation.parameters)
    series = equation.prepare(t, 1e-12, names).integrate(values, 0.3, 0.2)
    np.testing.assert_allclose(exact.theta_rad, series.theta_rad, atol=1e-12)
    size = 1 + np.abs(series.d_theta).max(axis=0)
    np.testing.assert_allclose(exact.d_theta / size, series.d_theta / size, atol=1e-9)


def test_a_parameter_that_cancels_has_no_influence():
    solved = build_equation().solve(P, 1.0, 0.0, [0.0, 1.0], 1e-10, ["mass_kg", "length_m"])
    assert not solved.d_theta[:, 0].any()
    assert solved.d_theta[1, 1] != 0


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: build_equation(["linear_drags"]), "did you mean"),
        (lambda: build_equation(["formula"]), "needs its text"),
        (lambda: build_equation(["linear_drag"]).solve({"length_m": 1.0}, 0.1, 0, [0.0]), "g_m_per_s2"),
        (
            lambda: build_equation(ALL).solve(P, 0.1, 0, [0.0, 1.0], sensitivities=["masss_kg"]),
            "did you mean 'mass_kg'",
        ),
        (lambda: build_equation().solve(P, 0.1, 0, [0.0, 1.0], accuracy_rad=0), "positive"),
        (lambda: build_equation().solve(P, 0.1, 0, [-1.0, 1.0]), "increasing"),
    ],
)
def test_misuse_is_named(call, words):
    with pytest.raises(UsageError, match=words):
        call()


_TWO_PROCESSES = """
import os, sys, numpy as np
from toolkit.motion import build_equation, compiled
compiled.keeps_objects &= "PENDULAB_NUMBA_CACHE" not in os.environ
e = build_equation(["linear_drag"], small_angle=False)
s = e.solve({"mass_kg": .25, "length_m": .5, "g_m_per_s2": 9.8, "linear_drag.k_d_kg_per_s": .1}, 1.0, 0.0, np.linspace(0, 1, 5))
print(repr(float(s.theta_rad[-1])), "sympy" in sys.modules)
"""


def test_code_is_shared_by_processes_that_start_at_once(tmp_path):
    """Three processes on one empty cache, then a fourth that finds all made and needs no SymPy."""
    environment = {**os.environ, "PENDULAB_CACHE": str(tmp_path / "cache")}

    def start():
        return subprocess.Popen(
            [sys.executable, "-c", _TWO_PROCESSES], env=environment, stdout=subprocess.PIPE, text=True
        )

    racing = [start() for _ in range(3)]
    answers = {p.communicate()[0].split()[0] for p in racing}
    assert len(answers) == 1
    assert not list((tmp_path / "cache").glob("*.tmp"))
    assert start().communicate()[0].split() == [*answers, "False"]


def test_code_kept_by_numba_itself_gives_the_same_digits(tmp_path):
    """What systems do on which bare objects have not been tried, in a process that compiles and in one that finds it."""
    environment = {**os.environ, "PENDULAB_CACHE": str(tmp_path)}
    said = [
        subprocess.run(
            [sys.executable, "-c", _TWO_PROCESSES],
            env={**environment, **more},
            capture_output=True,
            text=True,
            check=True,
        ).stdout.split()[0]
        for more in ({}, {"PENDULAB_NUMBA_CACHE": "1"}, {"PENDULAB_NUMBA_CACHE": "1"})
    ]
    assert said[0] == said[1] == said[2]


def test_a_cache_that_cannot_be_written_is_replaced_by_a_temporary_one(tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("not a folder", encoding="utf-8")
    environment = {**os.environ, "PENDULAB_CACHE": str(blocked / "cache")}
    done = subprocess.run(
        [sys.executable, "-c", _TWO_PROCESSES], env=environment, capture_output=True, text=True, check=True
    )
    assert done.stdout
    assert not done.stderr


def test_dop853_table_obeys_the_order_conditions():
    from toolkit.motion.kernels.dop853_table import NODES, A

    weights, nodes, matrix = A[12, :12], NODES[:12], A[:12, :12]
    for power in range(8):
        assert weights @ nodes**power == pytest.approx(1 / (power + 1), abs=1e-14)
    for power in range(7):
        assert weights @ matrix @ nodes**power == pytest.approx(1 / ((power + 1) * (power + 2)), abs=1e-14)
    assert matrix.sum(axis=1) == pytest.approx(nodes, abs=1e-13)


def test_printed_equation_collects_powers_and_keeps_signs():
    assert build_equation(["linear_drag"]).latex.endswith(r"- k_d \ell^{2} \dot\theta")
    assert build_equation(["quadratic_drag"]).latex.endswith(r"- c \ell^{3} |\dot\theta| \dot\theta")
    moving = build_equation(["linear_drag", "moving_pivot"]).latex
    assert r"- k_d \ell \left(\ell \dot\theta - " in moving  # the velocity against the room, as one factor
    assert r"- m \ell \left(-a" in moving


def test_first_compilation_is_announced_and_the_next_is_not(tmp_path, monkeypatch):
    from toolkit.motion import compiled
    from toolkit.motion.equation import Equation

    heard = []
    monkeypatch.setattr(compiled, "cache_folder", lambda: tmp_path)
    monkeypatch.setattr(compiled, "listener", heard.append)
    for _ in range(2):
        assert "jet" in Equation(build_equation(["quadratic_drag"]).effects).source
    assert len(heard) == 1
    assert "compiling" in heard[0]
