"""A user's own torque, written as a formula in the scene. It is parsed from a whitelist and never run as Python.

    [effects.formula]
    torque = "-a * theta**3"        # N·m
    a = 0.02                        # the formula's own parameters, by any name

Names that a formula may use: t, theta, omega, pi, the scene's mass_kg, length_m, bob_radius_m, g_m_per_s2,
fluid_density_kg_per_m3, fluid_viscosity_pa_s, and its own parameters; functions sin, cos, tan, exp, log, sqrt,
tanh, abs, sign; operators + − * / ** and brackets.
"""

from __future__ import annotations

import ast
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

from toolkit.effects.effect import Effect, Parameter, Term
from toolkit.errors import UsageError
from toolkit.registry import did_you_mean

STATE = ("t", "theta", "omega", "pi")
SCENE = ("mass_kg", "length_m", "bob_radius_m", "g_m_per_s2", "fluid_density_kg_per_m3", "fluid_viscosity_pa_s")
FUNCTIONS = ("sin", "cos", "tan", "exp", "log", "sqrt", "tanh", "abs", "sign")
_LONGEST, _DEEPEST, _HIGHEST_POWER, _LARGEST = 500, 40, 12, 1e12
_BINARY = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Pow: "**"}


def _term(s: Any) -> Term:
    return Term(torque=_value(_parsed(s.formula_text), s))


EFFECT = Effect(
    name="formula",
    meaning="a torque of your own, written as a formula in the scene",
    term=_term,
    parameters=(Parameter("torque", "N m", "the formula; its own parameters follow by name"),),
    needs=("mass_kg",),
    valid="what the formula says; a kink elsewhere than in abs(omega) or sign(omega) costs accuracy",
    reference="the scene's author",
)


def check_formula(table: Mapping[str, Any]) -> dict[str, Any]:
    """The table of [effects.formula], checked. Raises UsageError in one line; nothing of it is executed."""
    text = table.get("torque")
    if not isinstance(text, str):
        raise UsageError(f'[effects.formula] needs torque = "…", a formula in N m, got {str(text)[:40]!r}')
    own = formula_parameters(text)
    values: dict[str, Any] = {"torque": text}
    for key, value in table.items():
        if key == "torque":
            continue
        if key not in own:
            raise UsageError(f"[effects.formula] gives {key!r}, which its torque does not use{did_you_mean(key, own)}")
        if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < float("inf"):
            raise UsageError(f"{key} in [effects.formula] must be a finite number, got {str(value)[:40]!r}")
        values[key] = float(value)
    missing = [name for name in own if name not in values]
    if missing:
        known = did_you_mean(missing[0], [*STATE, *SCENE, *FUNCTIONS])
        raise UsageError(f"[effects.formula] torque uses {missing[0]!r} without a value{known}; add {missing[0]} = …")
    return values


def formula_parameters(text: str) -> tuple[str, ...]:
    """The names in a formula that are its own parameters, in order of appearance. Raises UsageError."""
    own: dict[str, None] = {}
    for node in ast.walk(_parsed(text)):
        if isinstance(node, ast.Name) and node.id not in (*STATE, *SCENE, *FUNCTIONS):
            own[node.id] = None
    return tuple(own)


def formula_needs(text: str) -> tuple[str, ...]:
    """The scene quantities that a formula uses."""
    used = {node.id for node in ast.walk(_parsed(text)) if isinstance(node, ast.Name)}
    return tuple(name for name in SCENE if name in used)


@lru_cache(maxsize=64)
def _parsed(text: str) -> ast.expr:
    if len(text) > _LONGEST:
        raise UsageError(f"a formula may have {_LONGEST} characters, this one has {len(text)}; shorten it")
    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        raise UsageError(f"cannot read the formula {text[:40]!r}; write it like -a*theta**3") from error
    _check(tree, 0)
    return tree


def _check(node: ast.expr, depth: int) -> None:
    if depth > _DEEPEST:
        raise UsageError(f"a formula may be nested {_DEEPEST} deep, this one is deeper; simplify it")
    match node:
        case ast.Constant(value=value):
            if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= _LARGEST:
                raise UsageError(f"a formula may hold numbers up to {_LARGEST:g}, got {str(value)[:40]!r}")
        case ast.Name(id=name):
            if name.startswith("_") or not name.isascii():
                raise UsageError(
                    f"a formula may not use the name {name[:40]!r}; names are letters, digits and _ inside"
                )
            if name in FUNCTIONS and depth >= 0:
                raise UsageError(f"{name} is a function: write {name}(…)")
        case ast.UnaryOp(op=ast.UAdd() | ast.USub(), operand=operand):
            _check(operand, depth + 1)
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _BINARY:
            _check(left, depth + 1)
            _check(right, depth + 1)
            if isinstance(op, ast.Pow):
                _power(right)
        case ast.Call(func=ast.Name(id=name), args=[argument], keywords=[]) if name in FUNCTIONS:
            if isinstance(argument, ast.Starred):
                raise UsageError("a formula may not use *; write one argument")
            _check(argument, depth + 1)
        case ast.Call():
            called = node.func.id if isinstance(node.func, ast.Name) else "that"
            raise UsageError(f"a formula may call {', '.join(FUNCTIONS)} with one argument, not {called[:40]!r}")
        case _:
            kind = type(node).__name__
            raise UsageError(f"a formula may hold numbers, names, + - * / ** and {', '.join(FUNCTIONS)}, not {kind}")


def _power(node: ast.expr) -> float:
    """The exponent as a number: a plain constant, with a sign or as a fraction, of bounded size."""
    match node:
        case ast.Constant(value=value):
            exponent = float(value)  # type: ignore[arg-type]
        case ast.UnaryOp(op=ast.USub(), operand=ast.Constant(value=value)):
            exponent = -float(value)  # type: ignore[arg-type]
        case ast.BinOp(left=ast.Constant(value=a), op=ast.Div(), right=ast.Constant(value=b)) if b:
            exponent = float(a) / float(b)  # type: ignore[arg-type]
        case _:
            raise UsageError("an exponent in a formula must be a number such as 2, -1 or 1.5")
    if abs(exponent) > _HIGHEST_POWER:
        raise UsageError(f"an exponent in a formula may be up to {_HIGHEST_POWER}, got {exponent:g}")
    return exponent


def _value(node: ast.expr, s: Any) -> Any:
    """The formula over the symbols `s`: SymPy's, LaTeX's or numbers."""
    match node:
        case ast.Constant(value=value):
            return value
        case ast.Name(id=name):
            return getattr(s, name)
        case ast.UnaryOp(op=op, operand=operand):
            inner = _value(operand, s)
            return -inner if isinstance(op, ast.USub) else inner
        case ast.BinOp(left=left, op=op, right=right):
            a = _value(left, s)
            if isinstance(op, ast.Pow):
                exponent = _power(right)
                return a ** (int(exponent) if exponent == int(exponent) else exponent)
            b = _value(right, s)
            match op:
                case ast.Add():
                    return a + b
                case ast.Sub():
                    return a - b
                case ast.Mult():
                    return a * b
                case _:
                    return a / b
        case ast.Call(func=ast.Name(id=name), args=[argument]):
            return getattr(s, name)(_value(argument, s))
    raise AssertionError(node)  # _check lets nothing else through
