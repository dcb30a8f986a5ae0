"""Runs the statements of a program: jumps, branches, loops, subprograms and variables, within stated bounds."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field

from toolpoint.io.program.expressions import ExpressionFault, Reader
from toolpoint.io.program.segments import Remarks
from toolpoint.io.program.statements import ProgramLines, Statement
from toolpoint.io.program.words import WordFault

# Lines that loops may run beside twenty times the program's own; passes of a loop that changes no variable: it never ends.
MOST_STEPS, OFTEN, STANDSTILL, DEEPEST = 100_000, 20, 1000, 20
# Characters of the lines that loops may run beside twenty times the program's own: long expressions take 2 to 4 us each, and
# lines of 20 reach the bound of lines first.
MOST_CHARACTERS = 2_000_000
MOST_FAULTS = 1000  # of a run; behind them nothing is told that helps
# What a block asks of the run: where to go on ("call 100 3", "return", "end"), or nothing.
Request = tuple[str, str, int] | None


@dataclass
class Run:
    """A run: variables, the counts of loops, the stack of calls."""

    listing: ProgramLines
    remarks: Remarks
    block: Callable[[int, str, int], Request]
    variables: dict[str, float] = field(default_factory=dict)
    unset: set[str] = field(default_factory=set)
    counts: dict[int, int] = field(default_factory=dict)
    calls: list[tuple[int, dict[str, float], str, int]] = field(default_factory=list)
    passes: dict[int, tuple[int, int]] = field(default_factory=dict)

    def execute(self) -> None:
        """Run from the top to the end of the program; faults and notes go to the remarks."""
        for number, message in self.listing.faults:
            self.remarks.fault(number, 1, message)
        at, steps, faults = 0, 0, 0
        statements = self.listing.statements
        most = MOST_STEPS + OFTEN * len(statements)
        lengths = [len(s.text) + len(s.other) + len(s.third) for s in statements]
        characters, most_characters = 0, MOST_CHARACTERS + OFTEN * sum(lengths)
        while 0 <= at < len(statements) and faults < MOST_FAULTS:
            steps += 1
            statement = statements[at]
            characters += lengths[at]
            if characters > most_characters:
                self.remarks.fault(statement.number, 1, f"lines of more than {most_characters} characters are run: a loop "
                                                        "without end?")
                return
            if steps > most:
                self.remarks.fault(statement.number, 1, f"more than {most} lines are run: a loop without end?")
                return
            try:
                after = self._step(at, statement)
                if after <= at and self._stands_still(after):
                    self.remarks.fault(statement.number, 1, f"a loop without end: {STANDSTILL} passes changed no variable")
                    return
                at = after
            except ExpressionFault as fault:
                self.remarks.fault(statement.number, statement.column + 1, str(fault))
                at, faults = self._past(at), faults + 1
            except WordFault as fault:
                self.remarks.fault(statement.number, statement.column + fault.column, str(fault))
                at, faults = at + 1, faults + 1
            except RecursionError:
                self.remarks.fault(statement.number, 1, "an expression nested too deeply")
                at += 1
            except OverflowError:
                self.remarks.fault(statement.number, 1, "too many moves, or a number that is too large")
                return

    def _stands_still(self, at: int) -> bool:
        """Return whether the run came back to a statement many times with all variables and counts as they were."""
        state = hash((at, tuple(self.variables.items()), tuple(self.counts.items()), len(self.calls),
                      tuple(call[0::3] for call in self.calls)))
        last, passes = self.passes.get(at, (0, 0))
        self.passes[at] = (state, passes + 1 if state == last else 0)
        return self.passes[at][1] > STANDSTILL

    def _past(self, at: int) -> int:
        """Return the statement behind a block whose condition has no value."""
        statement = self.listing.statements[at]
        return statement.branch + 1 if statement.kind in ("if", "while", "for", "repeat") and statement.branch >= 0 else at + 1

    def value(self, text: str) -> float:
        """Return the value of a whole text."""
        reader = Reader(text, self.variables, unset=self.unset)
        value = reader.value()
        if reader.skip():
            raise ExpressionFault(f"{text[reader.at:].strip()!r} behind an expression")
        return value

    def _step(self, at: int, s: Statement) -> int:
        if s.kind == "block":
            return self._requested(at, s, self.block(s.number, s.text, s.column))
        if s.kind in ("if", "elif", "else", "endif", "while", "endwhile", "dowhile", "loop", "endloop", "do", "until"):
            return self._branch(at, s)
        if s.kind in ("for", "endfor", "repeat", "endrepeat"):
            return self._count(at, s)
        if s.kind in ("goto", "if_goto", "if_then"):
            return self._jump(at, s)
        if s.kind in ("sub", "call", "endsub", "return", "subprogram", "break", "continue", "end"):
            return self._call(at, s)
        if s.kind == "m17":
            return self._return_or_pass(at, s)
        if s.kind == "define":
            for part in s.text.split(","):
                name, _, text = part.partition("=")
                self.variables[name.strip()] = self.value(text) if text.strip() else 0.0
        elif s.kind == "passed":
            self.remarks.without_motion(s.number, s.key)
        return at + 1

    def _return_or_pass(self, at: int, s: Statement) -> int:
        """M17 ends a subprogram (Siemens); outside of one and with blocks behind it it is a word of the machine's own."""
        behind = self.listing.statements[at + 1:]
        if self.calls or not any(later.kind == "block" for later in behind):
            return self._leave(at)
        self.remarks.without_motion(s.number, "M17")
        return at + 1

    def _branch(self, at: int, s: Statement) -> int:
        if s.kind in ("if", "while") and not self.value(s.text):
            return self._next_branch(s.branch)
        if s.kind in ("elif", "else"):  # the branch before has been run
            while s.branch >= 0:
                at, s = s.branch, self.listing.statements[s.branch]
        elif s.kind in ("endwhile", "endloop"):
            return s.start
        elif (s.kind == "dowhile" and self.value(s.text)) or (s.kind == "until" and not self.value(s.text)):
            return s.start + 1
        return at + 1

    def _next_branch(self, at: int) -> int:
        """Return the statement behind the first branch whose condition holds."""
        while at >= 0:
            s = self.listing.statements[at]
            if s.kind != "elif" or self.value(s.text):
                return at + 1
            at = s.branch
        return len(self.listing.statements)

    def _count(self, at: int, s: Statement) -> int:
        statements = self.listing.statements
        if s.kind == "repeat":
            self.counts[at] = round(self.value(s.text))
            return at + 1 if self.counts[at] > 0 else s.branch + 1
        if s.kind == "endrepeat":
            self.counts[s.start] -= 1
            return s.start + 1 if self.counts[s.start] > 0 else at + 1
        first = statements[s.start] if s.kind == "endfor" else s
        name = first.text.strip()
        self.variables[name] = self.value(first.other) if s.kind == "for" else self.variables.get(name, 0.0) + 1
        inside = self.variables[name] <= self.value(first.third)
        if s.kind == "for":
            return at + 1 if inside else s.branch + 1
        return s.start + 1 if inside else at + 1

    def _jump(self, at: int, s: Statement) -> int:
        if s.kind != "goto" and not self.value(s.text):
            return at + 1
        if s.kind == "if_then":
            return self._requested(at, s, self.block(s.number, s.other, s.column))
        target = s.other
        if target[:1] in "#[":
            target = str(round(self.value(target)))
        target = str(int(target[1:])) if re.fullmatch(r"N\d+", target) else target
        places = self.listing.places.get(str(int(target)) if target.isdigit() else target, [])
        after = [k for k in places if k > at]
        before = [k for k in places if k <= at]
        chosen = before[::-1] if s.third == "B" else after if s.third == "F" else after + before
        if not chosen:
            raise ExpressionFault(f"GOTO{s.third} {target}: no such line or label")
        return chosen[0]

    def _call(self, at: int, s: Statement) -> int:
        statements = self.listing.statements
        if s.kind == "sub":
            return s.branch + 1  # a definition in passing; a call begins behind it
        if s.kind == "call":
            arguments = re.findall(r"\[((?:[^\[\]]|\[[^\]]*\])*)\]", s.text)
            values = {f"#{k}": self.value(text) for k, text in enumerate(arguments, 1)}
            return self._enter(at, s.number, s.key, values)
        if s.kind == "subprogram":
            return self._enter(at, s.number, s.text, {}, int(s.other))
        if s.kind in ("endsub", "return"):
            return self._leave(at)
        if s.kind in ("break", "continue"):
            loop = next((k for k in range(at, -1, -1) if statements[k].key == s.key and statements[k].kind in
                         ("while", "do", "repeat")), None)
            if loop is None or statements[loop].branch < 0:
                raise ExpressionFault(f"{s.kind.upper()} outside a loop")
            return statements[loop].branch + (s.kind == "break")
        return len(statements)

    def _requested(self, at: int, s: Statement, request: Request) -> int:
        if request is None:
            return at + 1
        verb, name, repeats = request
        if verb == "end":
            return len(self.listing.statements)
        return self._leave(at) if verb == "return" else self._enter(at, s.number, name, {}, repeats)

    def _enter(self, at: int, number: int, name: str, values: dict[str, float], repeats: int = 1) -> int:
        place = self.listing.programs.get(str(int(name)) if name.isdigit() else name)
        if place is None:
            self.remarks.note(number, f"subprogram {name} is not in the file and is left out with its motion")
            return at + 1
        if len(self.calls) >= DEEPEST:
            raise ExpressionFault(f"subprograms nested more than {DEEPEST} deep")
        if repeats < 1:
            return at + 1
        local = {f"#{k}": self.variables[f"#{k}"] for k in range(1, 34) if f"#{k}" in self.variables}
        self.calls.append((at + 1, local, name, repeats - 1))
        self.variables.update(values)
        return place + 1

    def _leave(self, at: int) -> int:
        if not self.calls:
            return len(self.listing.statements)  # M99 of a main program: once is enough
        back, local, name, rest = self.calls.pop()
        if rest > 0:
            self.calls.append((back, local, name, rest - 1))
            return self.listing.programs[str(int(name)) if name.isdigit() else name] + 1
        self.variables.update(local)
        return back
