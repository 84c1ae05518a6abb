"""Taylor recurrences of an equation's basis functions, as source code.

Every function is a row of W; order k of each row follows from lower orders of the rows before it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from toolkit.motion.routes import ROW

_MOST_ROWS = 48  # a longer recurrence takes too long to compile: Runge–Kutta is then the better route


class NotAnalytic(Exception):
    """An expression without a Taylor recurrence; the Runge–Kutta route takes it."""


def _function(name: str, first: Sequence[str], each: Sequence[str], ends: Sequence[str]) -> str:
    lines = [f"def {name}(q, s, W, R, n):", "    sigma = s[3]", "    k = 0", *("    " + line for line in first)]
    if each:
        lines += ["    for k in range(1, n):", *("        " + line for line in each)]
    return "\n".join([*lines, *("    " + line for line in ends)])


class Jet:
    """Writes jet(q, s, W, R, n): Taylor coefficients 0 … n of θ and w, 0 … n − 1 of F and of the functions in F, F_θ, F_w, F_τ.

    s holds τ, θ, w, its sign, and what rounding took from θ. And more(q, s, W, R, n), to be called after it: those of the functions that only the sensitivities need.
    """

    def __init__(self, writer: Any):
        self.writer, self.state = writer, writer.state
        self.inside = writer.inside
        self.count = 3 + len(writer.basis)  # rows: θ, w, F, then the basis functions, then scratch
        self.known: dict[Any, int] = {self.state["theta"]: 0, self.state["w"]: 1}
        self.first: list[str] = []  # order 0
        self.each: list[str] = []  # order k > 0

    def source(self) -> str:
        """Both functions, and N_WORK, the rows of W that they use. Raises NotAnalytic."""
        basis, own = self.writer.basis, {column for row in self.writer.matrix[:4] for column in row}
        for i in sorted(own):
            self._basis(basis[i], 3 + i)
        at_first, at_each = self.first, self.each
        self.first, self.each = [], []
        for i in sorted(set(range(len(basis))) - own):
            self._basis(basis[i], 3 + i)
        if self.count > _MOST_ROWS:
            raise NotAnalytic
        q = len(self.writer.inner)
        parts = [f"q[{q + i}] * W[{(3 + column) * ROW} + k]" for i, column in enumerate(self.writer.matrix[0])]
        force = f"f = W[{2 * ROW} + k] = {' + '.join(parts) or '0.0'}"
        ends = [f"W[n] = W[{ROW} + n - 1] * R[n]", f"W[{ROW} + n] = W[{2 * ROW} + n - 1] * R[n]"]
        states = ["W[k] = w * R[k]", f"w = W[{ROW} + k] = f * R[k]"]
        jet = _function(
            "jet", ["W[0] = s[1]", f"w = W[{ROW}] = s[2]", *at_first, force], [*states, *at_each, force], ends
        )
        return f"{jet}\n\n{_function('more', self.first, self.each, [])}\n\nN_WORK = {self.count}\n"

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
                "for j in range(1, (k + 1) // 2):",
                f"    v += W[{a * ROW} + j] * W[{a * ROW} + k - j]",
                "v *= 2.0",
                "if k % 2 == 0:",
                f"    v += W[{a * ROW} + k // 2] * W[{a * ROW} + k // 2]",
                f"v += 2.0 * W[{a * ROW}] * W[{a * ROW} + k]",  # the newest last: nothing waits for it
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
                f"c{sine}, c{cosine} = {r} * R[k] * c{cosine}, -{r} * R[k] * c{sine}",
                f"W[{sine * ROW} + k] = c{sine}",
                f"W[{cosine * ROW} + k] = c{cosine}",
            ]
        else:
            a = self._row(angle)
            self.first.append(f"v = W[{a * ROW}]")
            # j a_j of the argument's series; for θ itself j θ_j = w_{j−1}. Two sums side by side keep the machine busy,
            # and the terms with the newest coefficients come last, so that nothing waits for them.
            term = "W[{} + {} - 1]" if a == 0 else "({1}) * W[{0} + {1}]"
            base = ROW if a == 0 else a * ROW
            one, two, left, last = (term.format(base, j) for j in ("j", "j - 1", "2", "1"))
            self.each += [
                "u, v, u2, v2 = 0.0, 0.0, 0.0, 0.0",
                "j = k",
                "while j >= 3:",
                f"    x, y = {one}, {two}",
                f"    u += x * W[{cosine * ROW} + k - j]",
                f"    v += x * W[{sine * ROW} + k - j]",
                f"    u2 += y * W[{cosine * ROW} + k - j + 1]",
                f"    v2 += y * W[{sine * ROW} + k - j + 1]",
                "    j -= 2",
                "u += u2",
                "v += v2",
                "if j == 2:",
                f"    x = {left}",
                f"    u += x * W[{cosine * ROW} + k - 2]",
                f"    v += x * W[{sine * ROW} + k - 2]",
                f"x = {last}",
                f"u = (u + x * c{cosine}) * R[k]",
                f"v = (v + x * c{sine}) * R[k]",
                f"c{sine}, c{cosine} = u, -v",
                f"W[{sine * ROW} + k] = c{sine}",
                f"W[{cosine * ROW} + k] = c{cosine}",
            ]
        self.first += [f"W[{sine * ROW}] = math.sin(v)", f"W[{cosine * ROW}] = math.cos(v)"]
        if angle == self.state["theta"]:  # what rounding took from θ counts after many turns
            self.first += [f"u, v = s[4] * W[{cosine * ROW}], s[4] * W[{sine * ROW}]"]
            self.first += [f"W[{sine * ROW}] += u", f"W[{cosine * ROW}] -= v"]
        # the newest coefficients stay in registers: they need not be stored before they are used
        self.first += [f"c{sine} = W[{sine * ROW}]", f"c{cosine} = W[{cosine * ROW}]"]
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
