"""Expressions of controls: numbers, variables, brackets, functions and comparisons, read from a place in a line.

Variables are #1, #[1 + #2], #<name> (Fanuc, LinuxCNC), R1, R[2] and declared names (Siemens), Q1, QL1 (Klartext). Angles are
degrees, a true comparison is 1. Operators, from the strongest: ** ; * / MOD DIV ; + - ; comparisons ; AND ; OR XOR.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, MutableMapping

_NUMBER = re.compile(r"\s*(\d+\.?\d*|\.\d+)")
_NAME = re.compile(r"\s*(\$?[A-Z_][A-Z_0-9]*)")
_COMPARE: dict[str, Callable[[float, float], bool]] = {
    "EQ": lambda a, b: a == b, "NE": lambda a, b: a != b, "GT": lambda a, b: a > b, "GE": lambda a, b: a >= b,
    "LT": lambda a, b: a < b, "LE": lambda a, b: a <= b, "==": lambda a, b: a == b, "<>": lambda a, b: a != b,
    ">=": lambda a, b: a >= b, "<=": lambda a, b: a <= b, ">": lambda a, b: a > b, "<": lambda a, b: a < b}
# Longest first, so that >= is not read as >; with them the characters that such an operator begins with.
_LEVELS = tuple((tuple(sorted(signs, key=len, reverse=True)), frozenset(sign[0] for sign in signs)) for signs in (
    ("OR", "XOR", "||"), ("AND", "&&"), tuple(_COMPARE), ("+", "-"), ("*", "/", "MOD", "DIV"), ("**",)))
_FUNCTIONS: dict[str, Callable[[float], float]] = {
    "SIN": lambda v: math.sin(math.radians(v)), "COS": lambda v: math.cos(math.radians(v)),
    "TAN": lambda v: math.tan(math.radians(v)), "ASIN": lambda v: math.degrees(math.asin(v)),
    "ACOS": lambda v: math.degrees(math.acos(v)), "ATAN": lambda v: math.degrees(math.atan(v)), "SQRT": math.sqrt, "ABS": abs,
    "SGN": lambda v: float((v > 0) - (v < 0)),
    "ROUND": lambda v: math.floor(v + 0.5), "FIX": math.floor, "FUP": math.ceil, "TRUNC": math.trunc, "INT": math.trunc,
    "FRAC": lambda v: v - math.trunc(v), "LN": math.log, "EXP": math.exp, "POT": lambda v: v * v, "NOT": lambda v: float(not v),
    "NEG": lambda v: -v}
# The longest first: ASIN must not be read as a name with SIN at its end, nor ATAN2 as ATAN.
_BY_LENGTH = sorted(_FUNCTIONS, key=len, reverse=True)
# R and Q with a digit or bracket are variables; R alone is the radius of an arc.
_PARAMETER = re.compile(r"(R|Q[LRS]?)(\d|\[)")
_MAX_BRACKET_DEPTH = 50  # each takes one Python call a level of precedence: far below the interpreter's own limit


class ExpressionFault(Exception):
    """Fault of an expression, in words."""


class Reader:
    """Reads expressions from one line, in capitals; `position` is the place of the next character.

    Variables are read from `variables` (keys like ``#1``, ``#<depth>``, ``R1``, ``Q5``); the keys of `unset` that were read
    though nothing was assigned to them count as zero and are collected there.
    """

    def __init__(self, text: str, variables: MutableMapping[str, float], position: int = 0,
                 unset: set[str] | None = None) -> None:
        self.text, self.variables, self.position, self.depth = text, variables, position, 0
        self.unset = set() if unset is None else unset

    def skip(self) -> str:
        """Pass blanks and return the next character, empty at the end."""
        text, position = self.text, self.position
        while text[position:position + 1].isspace():
            position += 1
        self.position = position
        return text[position:position + 1]

    def take(self, sign: str) -> bool:
        """Pass a sign if it stands next."""
        self.skip()
        if self.text.startswith(sign, self.position):
            self.position += len(sign)
            return True
        return False

    def value(self, level: int = 0) -> float:
        """Return the value of the expression that stands next, of operators of at least a level."""
        if level == len(_LEVELS):
            return self._unary()
        self.depth += 1
        if self.depth > _MAX_BRACKET_DEPTH * len(_LEVELS):
            raise ExpressionFault("brackets nested too deeply")
        left = self.value(level + 1)
        while operator := self._operator(level):
            left = _apply(operator, left, self.value(level + 1))
        self.depth -= 1
        return left

    def sum(self) -> float:
        """Return a value of sums and products, as it stands behind a letter: comparisons end it."""
        return self.value(3)

    def _operator(self, level: int) -> str:
        operators, firsts = _LEVELS[level]
        if self.skip() not in firsts:
            return ""
        for operator in operators:
            is_power = operator == "*" and self.text.startswith("**", self.position)
            if is_power or not self.text.startswith(operator, self.position):
                continue
            self.position += len(operator)
            return operator
        return ""

    def _unary(self) -> float:
        if self.take("-"):
            return -self._unary()
        if self.take("+"):
            return self._unary()
        return self._primary()

    def _primary(self) -> float:
        mark = self.skip()
        if mark in ("[", "("):
            return self._bracket()
        if mark == "#" or _PARAMETER.match(self.text, self.position):
            return self._variable()
        if number := _NUMBER.match(self.text, self.position):
            self.position = number.end()
            return float(number[1])
        name = _NAME.match(self.text, self.position)
        if name is None:
            piece = self.text[self.position:self.position + 12].strip() or "the end of the line"
            raise ExpressionFault(f"{piece!r} where a value is expected")
        word = next((f for f in _BY_LENGTH if self.text.startswith(f, name.start(1))), "")
        if name[1].startswith("ATAN2"):
            return self._two_angles(name.start(1) + 5)
        if word and name[1] not in self.variables:
            return self._function(word, name.start(1) + len(word))
        if name[1] == "TRUE" or name[1] == "FALSE":
            self.position = name.end()
            return float(name[1] == "TRUE")
        if name[1] not in self.variables:
            raise ExpressionFault(f"{name[1]} is not a variable of the program")
        self.position = name.end()
        return self.variables[name[1]]

    def _bracket(self) -> float:
        close = "]" if self.text[self.position] == "[" else ")"
        self.position += 1
        value = self.value()
        if not self.take(close):
            raise ExpressionFault(f"{close!r} is missing")
        return value

    def _function(self, word: str, position: int) -> float:
        self.position = position
        operand = self._unary()
        try:
            if word == "ATAN" and self.take("/"):
                return math.degrees(math.atan2(operand, self._unary()))
            return float(_FUNCTIONS[word](operand))
        except (ValueError, OverflowError):
            raise ExpressionFault(f"{word} of {operand:g} has no value") from None

    def _two_angles(self, position: int) -> float:
        self.position = position
        if not self.take("("):
            raise ExpressionFault("ATAN2 needs two values in brackets")
        first = self.value()
        self.take(",")
        second = self.value()
        self.take(")")
        return math.degrees(math.atan2(first, second))

    def variable_name(self) -> str:
        """Pass the name of a variable and return its key."""
        self.skip()
        if self.take("#"):
            if self.take("<"):
                end = self.text.find(">", self.position)
                if end < 0:
                    raise ExpressionFault("'>' is missing")
                name = f"#<{self.text[self.position:end].strip()}>"
                self.position = end + 1
                return name
            return f"#{self._index()}"
        match = re.compile(r"(QL|QR|QS|Q|R)").match(self.text, self.position)
        if match is None:
            raise ExpressionFault("the name of a variable is expected")
        self.position = match.end()
        return f"{match[1]}{self._index()}"

    def _index(self) -> int:
        mark = self.skip()
        index = self._bracket() if mark in ("[", "(") else self._variable() if mark == "#" else self._whole()
        return round(index)

    def _whole(self) -> float:
        number = re.compile(r"\d+").match(self.text, self.position)
        if number is None:
            raise ExpressionFault("the number of a variable is expected")
        self.position = number.end()
        return float(number[0])

    def _variable(self) -> float:
        name = self.variable_name()
        if name not in self.variables:
            self.unset.add(name)
        return self.variables.get(name, 0.0)


def _apply(operator: str, a: float, b: float) -> float:
    if operator in _COMPARE:
        return float(_COMPARE[operator](a, b))
    if operator in ("AND", "&&"):
        return float(bool(a) and bool(b))
    if operator in ("OR", "||"):
        return float(bool(a) or bool(b))
    if operator == "XOR":
        return float(bool(a) != bool(b))
    if operator in ("/", "MOD", "DIV") and b == 0:
        raise ExpressionFault("a division by zero")
    try:
        value = {"+": lambda: a + b, "-": lambda: a - b, "*": lambda: a * b, "/": lambda: a / b, "MOD": lambda: a % b,
                 "DIV": lambda: float(a // b), "**": lambda: a**b}[operator]()
    except OverflowError:
        raise ExpressionFault(f"{a:g} {operator} {b:g} is too large") from None
    if isinstance(value, complex):
        raise ExpressionFault(f"{a:g} ** {b:g} has no real value")
    return value
