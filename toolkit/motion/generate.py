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

ROW = 32  # Taylor coefficients kept of each basis function
_MOST_ROWS = 48  # a longer recurrence takes too long to compile: Runge–Kutta is then the better route


class NotAnalytic(Exception):
    """An expression without a Taylor recurrence; the Runge–Kutta route takes it."""


def write_source(names: Sequence[str], torque: Any, inertia: Any, state: dict[str, Any], header: str) -> str:
    """The source of a module that solves  inertia · θ'' = torque.

    names : the parameters, as SymPy symbols' names in order.    state : SymPy symbols tau, theta, w, scale, and
    `parameters` (name -> symbol); torque and inertia are written in them (t = scale·τ, ω = w/scale).
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
    return _Writer(names, state, sigma, size, list(basis), matrix, header).source()


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
    """Writes the module: coefficients() and partials() in Python, jet() and terms() for Numba."""

    def __init__(self, names: Sequence[str], state: Any, sigma: Any, size: Any, basis: list, matrix: list, header: str):
        self.names, self.state, self.sigma, self.size = list(names), state, sigma, size
        self.basis, self.matrix, self.header = basis, matrix, header
        self.inner: dict[Any, int] = {}  # parameter-only expressions inside the basis functions
        self.inside = {state["theta"], state["w"], state["tau"], sigma, size}

    def source(self) -> str:
        try:
            jet = _Jet(self).function()
        except NotAnalytic:
            jet = ""
            self.inner.clear()
        self.analytic = bool(jet)
        terms = self.terms()
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

    def terms(self) -> str:
        """terms(q, s, out): the values of the basis functions at one point s = (τ, θ, w, σ)."""
        import sympy as sp

        replaced = [self._inner_out(f) for f in self.basis]
        common, reduced = sp.cse(replaced, symbols=sp.numbered_symbols("x"))
        lines = ["def terms(q, s, out):"]
        lines += ["    tau, theta, w, sigma = s[0], s[1], s[2], s[3]"]
        if any(f.has(self.size) for f in self.basis):
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


class _Jet:
    """Writes jet(q, s, W, R, n): Taylor coefficients 0 … n of θ and w, and 0 … n − 1 of all basis functions."""

    def __init__(self, writer: _Writer):
        self.writer, self.state = writer, writer.state
        self.inside = writer.inside
        self.count = 3 + len(writer.basis)  # rows: θ, w, F, then the basis functions, then scratch
        self.known: dict[Any, int] = {self.state["theta"]: 0, self.state["w"]: 1}
        self.first: list[str] = []  # order 0
        self.each: list[str] = []  # order k > 0

    def function(self) -> str:
        for i, function in enumerate(self.writer.basis):
            self._basis(function, 3 + i)
            if self.count > _MOST_ROWS:
                raise NotAnalytic
        lengths = [len(self.writer.inner)]
        force = self.writer.matrix[0]
        parts = [f"q[{lengths[0] + i}] * W[{(3 + column) * ROW} + k]" for i, column in enumerate(force)]
        total = " + ".join(parts) or "0.0"
        lines = ["def jet(q, s, W, R, n):"]
        lines += ["    sigma = s[3]", "    k = 0", "    W[0] = s[1]", f"    W[{ROW}] = s[2]"]
        lines += ["    " + line for line in self.first]
        lines += [f"    W[{2 * ROW}] = {total}", "    for k in range(1, n):"]
        step = [f"W[k] = W[{ROW} + k - 1] * R[k]", f"W[{ROW} + k] = W[{2 * ROW} + k - 1] * R[k]", *self.each]
        step += [f"W[{2 * ROW} + k] = {total}"]
        lines += ["        " + line for line in step]
        lines += [f"    W[n] = W[{ROW} + n - 1] * R[n]", f"    W[{ROW} + n] = W[{2 * ROW} + n - 1] * R[n]"]
        return "\n".join(lines) + f"\n\nN_WORK = {self.count}\n"

    def _basis(self, function: Any, row: int) -> None:
        """Fill the row of one basis function: σ^a times a product of series."""
        import sympy as sp

        if function.has(self.writer.size):
            raise NotAnalytic
        if self.known.get(function) == row:  # came with its sine or cosine
            return
        plain, rest = function.as_independent(self.writer.sigma, as_Add=False)
        sign = "" if rest == 1 else "sigma * "
        at = f"{row * ROW}"
        if not plain.free_symbols & self.inside:
            self.first.append(f"W[{at}] = {sign}1.0")
            self.each.append(f"W[{at} + k] = 0.0")
            if plain != 1:
                raise NotAnalytic
            return
        if not sign and isinstance(plain, sp.Mul | sp.Pow | sp.sin | sp.cos) and plain not in self.known:
            made = self._row(plain, row)
            if made == row:
                return
        else:
            made = self._row(plain)
        self.first.append(f"W[{at}] = {sign}W[{made * ROW}]")
        self.each.append(f"W[{at} + k] = {sign}W[{made * ROW} + k]")

    def _scratch(self) -> int:
        self.count += 1
        return self.count - 1

    def _row(self, expression: Any, into: int | None = None) -> int:
        """The row that holds this expression's series, written if it is new."""
        import sympy as sp

        if expression in self.known:
            return self.known[expression]
        tau = self.state["tau"]
        if expression == tau:
            row = self._scratch()
            self.first.append(f"W[{row * ROW}] = s[0]")
            self.each.append(f"W[{row * ROW} + k] = 1.0 if k == 1 else 0.0")
        elif isinstance(expression, sp.Add):
            row = self._sum(expression, into)
        elif isinstance(expression, sp.Mul):
            row = self._product(expression, into)
        elif isinstance(expression, sp.Pow):
            row = self._power(expression, into)
        elif isinstance(expression, sp.sin | sp.cos):
            row = self._circular(expression, into)
        elif isinstance(expression, sp.exp):
            row = self._exponential(expression)
        else:
            raise NotAnalytic
        self.known[expression] = row
        return row

    def _constant(self, expression: Any) -> str:
        if expression.is_number:
            return repr(float(expression))
        return f"q[{self.writer.inner_index(expression)}]"

    def _sum(self, expression: Any, into: int | None) -> int:
        plain, rest = expression.as_independent(*self.inside)
        import sympy as sp

        parts = []
        for piece in sp.Add.make_args(rest):
            factor, function = piece.as_independent(*self.inside, as_Add=False)
            parts.append((self._constant(factor), self._row(function)))
        row = self._scratch()
        text = " + ".join(f"{c} * W[{r * ROW} + k]" for c, r in parts)
        self.first.append(f"W[{row * ROW}] = {self._constant(plain)} + {text}")
        self.each.append(f"W[{row * ROW} + k] = {text}")
        return row

    def _product(self, expression: Any, into: int | None) -> int:
        factor, rest = expression.as_independent(*self.inside, as_Add=False)
        import sympy as sp

        pieces = sp.Mul.make_args(rest)
        if factor != 1:
            inner = self._row(rest)
            row = self._scratch()
            for lines in (self.first, self.each):
                lines.append(f"W[{row * ROW} + k] = {self._constant(factor)} * W[{inner * ROW} + k]")
            return row
        made = self._row(pieces[0])
        for i, piece in enumerate(pieces[1:]):
            last = i == len(pieces) - 2
            made = self._convolve(made, self._row(piece), into if last else None)
        return made

    def _convolve(self, a: int, b: int, into: int | None = None) -> int:
        row = self._scratch() if into is None else into
        self.first.append(f"W[{row * ROW}] = W[{a * ROW}] * W[{b * ROW}]")
        if a == b:
            self.each += [
                "v = 0.0",
                "for j in range((k + 1) // 2):",
                f"    v += W[{a * ROW} + j] * W[{a * ROW} + k - j]",
                "v *= 2.0",
                "if k % 2 == 0:",
                f"    v += W[{a * ROW} + k // 2] * W[{a * ROW} + k // 2]",
            ]
        else:
            self.each += [
                "v, v2 = 0.0, 0.0",
                "for j in range(0, k, 2):",
                f"    v += W[{a * ROW} + j] * W[{b * ROW} + k - j]",
                f"    v2 += W[{a * ROW} + j + 1] * W[{b * ROW} + k - j - 1]",
                "v += v2",
                "if k % 2 == 0:",
                f"    v += W[{a * ROW} + k] * W[{b * ROW}]",
            ]
        self.each.append(f"W[{row * ROW} + k] = v")
        return row

    def _power(self, expression: Any, into: int | None) -> int:
        base, exponent = expression.args
        if exponent.is_Integer and 2 <= int(exponent) <= 12:
            half, odd = divmod(int(exponent), 2)
            root = self._row(base**half) if half > 1 else self._row(base)
            square = self._convolve(root, root, None if odd else into)
            return self._convolve(square, self._row(base), into) if odd else square
        if not exponent.is_number:
            raise NotAnalytic
        # u = a^p:  k a₀ u_k = Σ_{j<k} (p(k − j) − j) a_{k−j} u_j
        a, row, p = self._row(base), self._scratch(), repr(float(exponent))
        self.first.append(f"W[{row * ROW}] = W[{a * ROW}] ** {p}")
        self.each += [
            "v = 0.0",
            "for j in range(k):",
            f"    v += ({p} * (k - j) - j) * W[{a * ROW} + k - j] * W[{row * ROW} + j]",
            f"W[{row * ROW} + k] = v * R[k] / W[{a * ROW}]",
        ]
        return row

    def _circular(self, expression: Any, into: int | None) -> int:
        """sin and cos of one argument come together."""
        import sympy as sp

        angle = expression.args[0]
        other = (sp.cos if isinstance(expression, sp.sin) else sp.sin)(angle)
        row = self._scratch() if into is None else into
        pair = 3 + self.writer.basis.index(other) if other in self.writer.basis else self._scratch()
        self.known[other] = pair
        sine, cosine = (row, pair) if isinstance(expression, sp.sin) else (pair, row)
        rate = sp.diff(angle, self.state["tau"])
        if not angle.free_symbols & (self.inside - {self.state["tau"]}) and not rate.free_symbols & self.inside:
            plain = self._constant(angle.subs(self.state["tau"], 0))
            r = self._constant(rate)
            self.first.append(f"v = {plain} + {r} * s[0]")
            self.each += [
                f"W[{sine * ROW} + k] = {r} * W[{cosine * ROW} + k - 1] * R[k]",
                f"W[{cosine * ROW} + k] = -{r} * W[{sine * ROW} + k - 1] * R[k]",
            ]
        else:
            a = self._row(angle)
            self.first.append(f"v = W[{a * ROW}]")
            # j a_j of the argument's series; for θ itself j θ_j = w_{j−1}. Two sums side by side keep the machine busy.
            one = f"W[{ROW} + j - 1]" if a == 0 else f"j * W[{a * ROW} + j]"
            two = f"W[{ROW} + j]" if a == 0 else f"(j + 1) * W[{a * ROW} + j + 1]"
            self.each += [
                "u, v, u2, v2 = 0.0, 0.0, 0.0, 0.0",
                "for j in range(1, k, 2):",
                f"    x, y = {one}, {two}",
                f"    u += x * W[{cosine * ROW} + k - j]",
                f"    v += x * W[{sine * ROW} + k - j]",
                f"    u2 += y * W[{cosine * ROW} + k - j - 1]",
                f"    v2 += y * W[{sine * ROW} + k - j - 1]",
                "u += u2",
                "v += v2",
                "if k % 2 == 1:",
                f"    x = {one.replace('j', 'k')}",
                f"    u += x * W[{cosine * ROW}]",
                f"    v += x * W[{sine * ROW}]",
                f"W[{sine * ROW} + k] = u * R[k]",
                f"W[{cosine * ROW} + k] = -v * R[k]",
            ]
        self.first += [f"W[{sine * ROW}] = math.sin(v)", f"W[{cosine * ROW}] = math.cos(v)"]
        return row

    def _exponential(self, expression: Any) -> int:
        a, row = self._row(expression.args[0]), self._scratch()
        self.first.append(f"W[{row * ROW}] = math.exp(W[{a * ROW}])")
        self.each += [
            "v = 0.0",
            "for j in range(1, k + 1):",
            f"    v += j * W[{a * ROW} + j] * W[{row * ROW} + k - j]",
            f"W[{row * ROW} + k] = v * R[k]",
        ]
        return row


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
