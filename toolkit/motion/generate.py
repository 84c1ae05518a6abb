"""From the active effects to source code: SymPy derives, this module writes.

The equation is brought to the scaled form  w' = F(τ, θ, w; σ),  θ' = w,  with time in units of T (a power of two
seconds near 1/ω_g, so that scaling rounds nothing) and σ the sign of w on the present stretch of the motion.
F and all its derivatives (by θ, w, τ and every parameter) are sums of the same few basis functions of (τ, θ, w, σ)
with coefficients that depend on the parameters alone. Machine code is made for the basis only; the coefficients are
plain Python, evaluated once a solution. So an effect that is not active is in neither.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from toolkit.motion.jet import Jet, NotAnalytic


def write_source(
    names: Sequence[str], torque: Any, inertia: Any, state: dict[str, Any], header: str, tension: Any = None
) -> str:
    """The source of a module that solves  inertia · θ'' = torque.

    names : the parameters, as SymPy symbols' names in order.    state : SymPy symbols tau, theta, w, scale, and
    `parameters` (name -> symbol); torque and inertia are written in them (t = scale·τ, ω = w/scale).    tension : of the
    string, where that is watched.
    """
    import sympy as sp

    theta, w, tau, scale = (state[k] for k in ("theta", "w", "tau", "scale"))
    sigma, size = sp.Symbol("sigma", real=True), sp.Symbol("size", positive=True)  # sgn w and |w|
    inside = {theta, w, tau, sigma, size}

    def flat(expression: Any) -> Any:
        expression = expression.subs({sp.Abs(w): size, sp.sign(w): sigma}).replace(sp.DiracDelta, lambda *_: sp.S.Zero)
        return sp.expand(expression, power_base=True, multinomial=False, power_exp=False, log=False, trig=False)

    force = flat(scale**2 * torque)
    rows = [force, sp.diff(force, theta), sp.diff(force, w) + sigma * sp.diff(force, size), sp.diff(force, tau)]
    parameters = [state["parameters"][n] for n in names]
    basis: dict[Any, int] = {}
    matrix: list[dict[int, Any]] = []
    for row in [*rows, *[sp.diff(force, p) for p in parameters]]:
        entries: dict[int, Any] = {}
        for piece in sp.Add.make_args(flat(row)):
            if piece == 0:
                continue
            factor, function = _on_one_branch(piece, sigma, size, w).as_independent(*inside, as_Add=False)
            column = basis.setdefault(function, len(basis))
            entries[column] = entries.get(column, 0) + factor / inertia
        matrix.append(entries)
    for p, entries in zip(parameters, matrix[4:]):  # ∂(Q/I) = ∂Q/I − (Q/I) ∂I/I
        if change := sp.diff(inertia, p) / inertia:
            for column, factor in matrix[0].items():
                entries[column] = entries.get(column, 0) - factor * change
            for column in [c for c, factor in entries.items() if factor == 0]:
                del entries[column]
    return _Writer(names, state, sigma, size, list(basis), matrix, header, tension).source()


def _on_one_branch(piece: Any, sigma: Any, size: Any, w: Any) -> Any:
    """Whole powers of |w| become powers of σw, and σ² becomes 1; other powers of |w| stay."""
    import sympy as sp

    powers = piece.as_powers_dict()
    whole, signs = sp.sympify(powers.get(size, 0)), sp.sympify(powers.get(sigma, 0))
    if whole.is_Integer and whole > 0:
        piece = piece / size**whole * (sigma * w) ** whole
        signs += whole
    if signs.is_Integer and signs > 1:
        piece = piece / sigma**signs * sigma ** (signs % 2)
    return piece


class _Writer:
    """Writes the module: coefficients() and partials() in Python, jet(), more(), terms() and tension() for Numba."""

    def __init__(
        self, names: Sequence[str], state: Any, sigma: Any, size: Any, basis: list, matrix: list, header: str, pull: Any
    ):
        self.names, self.state, self.sigma, self.size = list(names), state, sigma, size
        self.basis, self.matrix, self.header, self.pull = basis, matrix, header, pull
        self.inner: dict[Any, int] = {}  # parameter-only expressions inside the basis functions
        self.inside = {state["theta"], state["w"], state["tau"], sigma, size}

    def source(self) -> str:
        terms = self.values("terms", self.basis)
        if self.pull is not None:
            terms += "\n\n" + self.values("tension", [self.pull])
        inner = dict(self.inner)
        try:
            jet = Jet(self).source()
        except NotAnalytic:
            jet, self.inner = "", inner
        self.analytic = bool(jet)
        parts = [f'r"""{self.header}"""', "import math", self.facts(), self.coefficients(), self.partials()]
        return "\n\n".join([*parts, jet, terms]) + "\n"

    def inner_index(self, expression: Any) -> int:
        return self.inner.setdefault(expression, len(self.inner))

    def facts(self) -> str:
        import sympy as sp

        lengths = []  # of the series of ∂F/∂θ and ∂F/∂w: 0 absent, 1 constant, 2 full
        for row in self.matrix[1:3]:
            functions = [self.basis[column] for column in row]
            lengths.append(max((1 if not f.free_symbols - {self.sigma} else 2 for f in functions), default=0))
        switches = any(f.has(self.sigma) or f.has(self.size) for f in self.basis)
        holds = any(
            self.basis[c].has(self.sigma) and self.basis[c].subs(self.state["w"], 0) != 0 for c in self.matrix[0]
        )
        timed = bool(self.matrix[3])
        rates = self.rates()
        return "\n".join(
            [
                f"NAMES = {tuple(self.names)!r}",
                f"ANALYTIC = {self.analytic}",
                f"SWITCHES = {switches}",
                f"HOLDS = {holds}",
                f"TIMED = {timed}",
                f"N_BASIS = {len(self.basis)}",
                f"JACOBIAN_LENGTHS = {tuple(lengths)!r}",
                f"BASIS = {tuple(sp.sstr(f) for f in self.basis)!r}",
                rates,
            ]
        )

    def rates(self) -> str:
        """The fastest angular rate at which the equation depends on time itself (per scaled time)."""
        import sympy as sp

        tau = self.state["tau"]
        found = {sp.diff(a.args[0], tau) for f in self.basis for a in f.atoms(sp.sin, sp.cos) if a.args[0].has(tau)}
        plain = [r for r in found if not r.free_symbols & self.inside]
        body = ", ".join(f"abs({_python(r)})" for r in plain)
        unpack = self._unpack(plain)
        return (
            f"def fastest_rate(p, scale):\n{unpack}    return max((1.0, {body}))"
            if plain
            else "def fastest_rate(p, scale):\n    return 1.0"
        )

    def _unpack(self, expressions: Sequence[Any]) -> str:
        used = set().union(*[e.free_symbols for e in expressions]) if expressions else set()
        lines = [
            f"    {_name(s)} = p[{i}]\n" for i, n in enumerate(self.names) if (s := self.state["parameters"][n]) in used
        ]
        return "".join(lines)

    def coefficients(self) -> str:
        """coefficients(p, scale): inner constants, then the entries of the rows F, F_θ, F_w, F_τ."""
        flat = list(self.inner) + [c for row in self.matrix[:4] for c in row.values()]
        lines = self._straight("coefficients", flat)
        return lines + f"\nN_INNER = {len(self.inner)}\n" + self._layout("ROWS", self.matrix[:4])

    def partials(self) -> str:
        """partials(p, scale): the entries of ∂F/∂parameter for every parameter, in the order of NAMES."""
        flat = [c for row in self.matrix[4:] for c in row.values()]
        return self._straight("partials", flat) + "\n" + self._layout("PARTIAL_ROWS", self.matrix[4:])

    def _layout(self, name: str, rows: Sequence[dict[int, Any]]) -> str:
        return f"{name} = {tuple(tuple(row) for row in rows)!r}"

    def _straight(self, name: str, flat: list[Any]) -> str:
        import sympy as sp

        common, reduced = sp.cse(flat, symbols=sp.numbered_symbols("x"))
        lines = [f"def {name}(p, scale):", self._unpack(flat).rstrip("\n")]
        lines += [f"    {_name(symbol)} = {_python(value)}" for symbol, value in common]
        lines += [f"    return ({' '.join(_python(value) + ',' for value in reduced)})"]
        return "\n".join(line for line in lines if line)

    def values(self, name: str, functions: Sequence[Any]) -> str:
        """name(q, s, out): the values of functions at one point s = (τ, θ, w, σ)."""
        import sympy as sp

        replaced = [self._inner_out(f) for f in functions]
        common, reduced = sp.cse(replaced, symbols=sp.numbered_symbols("x"))
        lines = [f"def {name}(q, s, out):"]
        lines += ["    tau, theta, w, sigma = s[0], s[1], s[2], s[3]"]
        if any(f.has(self.size) for f in functions):
            lines += ["    size = max(abs(w), 1e-300)"]
        lines += [f"    {_name(symbol)} = {_python(value)}" for symbol, value in common]
        lines += [f"    out[{i}] = {_python(value)}" for i, value in enumerate(reduced)]
        return "\n".join(lines)

    def _inner_out(self, expression: Any) -> Any:
        """The expression with its largest parameter-only parts replaced by symbols q0, q1 …"""
        import sympy as sp

        if not expression.free_symbols & self.inside:
            return expression if expression.is_number else sp.Symbol(f"q[{self.inner_index(expression)}]")
        if not expression.args:
            return expression
        if isinstance(expression, sp.Add | sp.Mul):
            plain, rest = expression.as_independent(*self.inside)
            if plain.free_symbols:
                kept = sp.Symbol(f"q[{self.inner_index(plain)}]")
                return expression.func(kept, self._inner_out(rest))
        parts = [self._inner_out(a) for a in expression.args]
        if isinstance(expression, sp.Pow) and not parts[1].is_Integer and parts[0] != self.size:
            parts[0] += sp.Float(1e-300)  # a root of zero has a slope that is finite times zero, not NaN
        return expression.func(*parts)


def _name(symbol: Any) -> str:
    return str(symbol.name).replace(".", "__")


def _python(expression: Any) -> str:
    from sympy.printing.pycode import PythonCodePrinter

    class Printer(PythonCodePrinter):
        def _print_Symbol(self, symbol: Any) -> str:
            return _name(symbol)

        def _print_Integer(self, number: Any) -> str:
            return f"{int(number)}.0" if abs(int(number)) > 12 else str(int(number))

        def _print_Rational(self, number: Any) -> str:
            return repr(int(number.p) / int(number.q))

    text: str = Printer({"fully_qualified_modules": True}).doprint(expression)
    return text
