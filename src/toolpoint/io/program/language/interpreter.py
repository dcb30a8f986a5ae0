"""Runs the statements of a program: jumps, branches, loops, subprograms and variables, within stated bounds."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field

from toolpoint.io.program.language.expressions import ExpressionFault, Reader
from toolpoint.io.program.language.files_beside import FilesBeside
from toolpoint.io.program.language.remarks import Remarks
from toolpoint.io.program.language.statements import ProgramLines, Statement
from toolpoint.io.program.language.words import WordFault, split_words

# Lines that loops may run beside twenty times the program's own; passes of a loop that changes no variable: it never ends.
MAX_LOOP_LINES, LINES_PER_PROGRAM_LINE, MAX_STANDSTILL_PASSES, MAX_CALL_DEPTH = 100_000, 20, 1000, 20
# Characters of the lines that loops may run beside twenty times the program's own: long expressions take 2 to 4 us each, and
# lines of 20 reach the bound of lines first.
MAX_LOOP_CHARACTERS = 2_000_000
MAX_FAULTS = 1000  # of a run; behind them nothing is told that helps
# What a block asks of the run: where to go on ("call 100 3", "macro 9010 1", "return", "end"), or nothing.
Request = tuple[str, str, int] | None
LOCAL_VARIABLES = tuple(f"#{k}" for k in range(1, 34))  # of a macro or a subprogram of o-words
# Variables that the letters of G65 set (Fanuc, first kind of arguments).
_ARGUMENTS = dict(zip("ABCIJKDEFHMQRSTUVWXYZ", (1, 2, 3, 4, 5, 6, 7, 8, 9, 11, 13, *range(17, 27)), strict=True))


def macro_arguments(text: str, variables: dict[str, float]) -> dict[str, float]:
    """Return the local variables that a block G65 sets; raises WordFault for what is no word.

    >>> macro_arguments("G65 P9010 A5 X-2.5", {})
    {'#1': 5.0, '#24': -2.5}
    """
    words, values = split_words(text, dict(variables), set())[0], dict[str, float]()
    for word in words:
        if word.letter in _ARGUMENTS and (word.letter not in "M"):
            values[f"#{_ARGUMENTS[word.letter]}"] = word.value
    return values


def is_local(name: str) -> bool:
    """Return whether a variable belongs to one call: #1 to #33, and names of LinuxCNC that begin with no underscore."""
    return name in LOCAL_VARIABLES or (name.startswith("#<") and not name.startswith("#<_"))


@dataclass
class Run:
    """A run: variables, the counts of loops, the stack of calls."""

    listing: ProgramLines
    remarks: Remarks
    block: Callable[[int, str, int], Request]
    variables: dict[str, float] = field(default_factory=dict)
    unset: set[str] = field(default_factory=set)
    counts: dict[int, int] = field(default_factory=dict)
    calls: list[tuple[int, dict[str, float] | None, str, int]] = field(default_factory=list)
    passes: dict[int, tuple[int, int]] = field(default_factory=dict)
    neighbours: FilesBeside | None = None
    absent: dict[str, int] = field(default_factory=dict)  # subprograms that are not there, with the first line that calls them
    files: dict[str, int] = field(default_factory=dict)  # files of subprograms, with the first line that calls them
    _calling_line: int = 0  # of the program itself, while a file beside it is run

    def execute(self) -> None:
        """Run from the top to the end of the program; faults and notes go to the remarks."""
        for number, message in self.listing.faults:
            self.remarks.fault(number, 1, message)
        index, steps, faults = 0, 0, 0
        statements = self.listing.statements
        max_lines = MAX_LOOP_LINES + LINES_PER_PROGRAM_LINE * len(statements)
        size = sum(len(s.text) + len(s.other) + len(s.third) for s in statements)
        characters, max_characters = 0, MAX_LOOP_CHARACTERS + LINES_PER_PROGRAM_LINE * size
        while 0 <= index < len(statements) and faults < MAX_FAULTS:
            steps += 1
            statement = statements[index]
            number = self._enter_line(statement)
            characters += len(statement.text) + len(statement.other) + len(statement.third)
            if characters > max_characters:
                self.remarks.fault(number, 1, f"lines of more than {max_characters} characters are run: a loop "
                                                        "without end?")
                return
            if steps > max_lines:
                self.remarks.fault(number, 1, f"more than {max_lines} lines are run: a loop without end?")
                return
            try:
                following_index = self._step(index, statement)
                if following_index <= index and self._stands_still(following_index):
                    self.remarks.fault(number, 1, f"a loop without end: {MAX_STANDSTILL_PASSES} passes changed no "
                                       f"variable")
                    return
                index = following_index
            except ExpressionFault as fault:
                self.remarks.fault(number, statement.column + 1, str(fault))
                index, faults = self._past(index), faults + 1
            except WordFault as fault:
                self.remarks.fault(number, statement.column + fault.column, str(fault))
                index, faults = index + 1, faults + 1
            except RecursionError:
                self.remarks.fault(number, 1, "an expression nested too deeply")
                index += 1
            except OverflowError:
                self.remarks.fault(number, 1, "too many moves, or a number that is too large")
                return

    def _enter_line(self, s: Statement) -> int:
        """Return the line of the program that is run: in a file beside it that which called the file, named in all remarks."""
        if not s.file:
            self._calling_line, self.remarks.place = s.number, ""
        else:
            self.remarks.place = f", in line {s.number} of {s.file}"
        return self._calling_line

    def _stands_still(self, index: int) -> bool:
        """Return whether the run came back to a statement many times with all variables and counts as they were."""
        state = hash((index, tuple(self.variables.items()), tuple(self.counts.items()), len(self.calls),
                      tuple(call[0::3] for call in self.calls)))
        last, passes = self.passes.get(index, (0, 0))
        self.passes[index] = (state, passes + 1 if state == last else 0)
        return self.passes[index][1] > MAX_STANDSTILL_PASSES

    def _past(self, index: int) -> int:
        """Return the statement behind a block whose condition has no value."""
        statement = self.listing.statements[index]
        has_branch = statement.kind in ("if", "while", "for", "repeat") and statement.branch >= 0
        return statement.branch + 1 if has_branch else index + 1

    def value(self, text: str) -> float:
        """Return the value of a whole text."""
        reader = Reader(text, self.variables, unset=self.unset)
        value = reader.value()
        if reader.skip():
            raise ExpressionFault(f"{text[reader.position:].strip()!r} behind an expression")
        return value

    def _step(self, index: int, s: Statement) -> int:
        if s.kind == "block":
            return self._requested(index, s, self.block(self._calling_line, s.text, s.column))
        if s.kind in ("if", "elif", "else", "endif", "while", "endwhile", "dowhile", "loop", "endloop", "do", "until"):
            return self._branch(index, s)
        if s.kind in ("for", "endfor", "repeat", "endrepeat"):
            return self._count(index, s)
        if s.kind in ("goto", "if_goto", "if_then"):
            return self._jump(index, s)
        if s.kind in ("sub", "call", "endsub", "return", "subprogram", "break", "continue", "end"):
            return self._call(index, s)
        if s.kind == "m17":
            return self._return_or_pass(index, s)
        if s.kind == "define":
            for part in s.text.split(","):
                name, _, text = part.partition("=")
                self.variables[name.strip()] = self.value(text) if text.strip() else 0.0
        elif s.kind == "passed":
            self.remarks.without_motion(self._calling_line, s.key)
        return index + 1

    def _return_or_pass(self, index: int, s: Statement) -> int:
        """M17 ends a subprogram (Siemens); outside of one and with blocks behind it it is a word of the machine's own."""
        following = self.listing.statements[index + 1:]
        if self.calls or not any(other.kind == "block" for other in following):
            return self._leave(index)
        self.remarks.without_motion(s.number, "M17")
        return index + 1

    def _branch(self, index: int, s: Statement) -> int:
        if s.kind in ("if", "while") and not self.value(s.text):
            return self._next_branch(s.branch)
        if s.kind in ("elif", "else"):  # the branch before has been run
            while s.branch >= 0:
                index, s = s.branch, self.listing.statements[s.branch]
        elif s.kind in ("endwhile", "endloop"):
            return s.start
        elif (s.kind == "dowhile" and self.value(s.text)) or (s.kind == "until" and not self.value(s.text)):
            return s.start + 1
        return index + 1

    def _next_branch(self, index: int) -> int:
        """Return the statement behind the first branch whose condition holds."""
        while index >= 0:
            s = self.listing.statements[index]
            if s.kind != "elif" or self.value(s.text):
                return index + 1
            index = s.branch
        return len(self.listing.statements)

    def _count(self, index: int, s: Statement) -> int:
        statements = self.listing.statements
        if s.kind == "repeat":
            self.counts[index] = round(self.value(s.text))
            return index + 1 if self.counts[index] > 0 else s.branch + 1
        if s.kind == "endrepeat":
            self.counts[s.start] -= 1
            return s.start + 1 if self.counts[s.start] > 0 else index + 1
        first = statements[s.start] if s.kind == "endfor" else s
        name = first.text.strip()
        self.variables[name] = self.value(first.other) if s.kind == "for" else self.variables.get(name, 0.0) + 1
        inside = self.variables[name] <= self.value(first.third)
        if s.kind == "for":
            return index + 1 if inside else s.branch + 1
        return s.start + 1 if inside else index + 1

    def _jump(self, index: int, s: Statement) -> int:
        if s.kind != "goto" and not self.value(s.text):
            return index + 1
        if s.kind == "if_then":
            return self._requested(index, s, self.block(self._calling_line, s.other, s.column))
        target = s.other
        if target[:1] in "#[":
            target = str(round(self.value(target)))
        target = str(int(target[1:])) if re.fullmatch(r"N\d+", target) else target
        places = self.listing.places.get(str(int(target)) if target.isdigit() else target, [])
        places_ahead = [k for k in places if k > index]
        places_passed = [k for k in places if k <= index]
        chosen = places_passed[::-1] if s.third == "B" else places_ahead if s.third == "F" else places_ahead + places_passed
        if not chosen:
            raise ExpressionFault(f"GOTO{s.third} {target}: no such line or label")
        return chosen[0]

    def _call(self, index: int, s: Statement) -> int:
        statements = self.listing.statements
        if s.kind == "sub":
            return s.branch + 1  # a definition in passing; a call begins behind it
        if s.kind == "call":
            arguments = re.findall(r"\[((?:[^\[\]]|\[[^\]]*\])*)\]", s.text)
            values = {f"#{k}": self.value(text) for k, text in enumerate(arguments, 1)}
            return self._enter(index, self._calling_line, s.key, dict.fromkeys(LOCAL_VARIABLES[:30], 0.0) | values)
        if s.kind == "subprogram":
            return self._enter(index, self._calling_line, s.text, None, int(s.other))
        if s.kind in ("endsub", "return"):
            return self._leave(index)
        if s.kind in ("break", "continue"):
            loop = next((k for k in range(index, -1, -1) if statements[k].key == s.key and statements[k].kind in
                         ("while", "do", "repeat")), None)
            if loop is None or statements[loop].branch < 0:
                raise ExpressionFault(f"{s.kind.upper()} outside a loop")
            return statements[loop].branch + (s.kind == "break")
        return len(statements)

    def _requested(self, index: int, s: Statement, request: Request) -> int:
        if request is None:
            return index + 1
        verb, name, repeats = request
        if verb == "end":
            return len(self.listing.statements)
        if verb == "return":
            return self._leave(index)
        values = macro_arguments(s.text, self.variables) if verb == "macro" else None
        return self._enter(index, self._calling_line, name, values, repeats)

    def _enter(self, index: int, number: int, name: str, values: dict[str, float] | None, repeats: int = 1) -> int:
        """Begin a subprogram; with values (a macro, o-words) its variables are its own, without it shares the caller's."""
        name = str(int(name)) if name.isdigit() else name
        file = None if name in self.listing.programs or self.neighbours is None else self.neighbours.find(name)
        if file is not None:
            self.files[file.name] = number
            self.listing.append_file(name, file.name, file.text)
        place = self.listing.programs.get(name)
        if place is None:
            self.absent.setdefault(name, number)
            return index + 1
        if len(self.calls) >= MAX_CALL_DEPTH:
            raise ExpressionFault(f"subprograms nested more than {MAX_CALL_DEPTH} deep")
        if repeats < 1:
            return index + 1
        local = None if values is None else {key: value for key, value in self.variables.items() if is_local(key)}
        self.calls.append((index + 1, local, name, repeats - 1))
        if values is not None:
            self._set_local(values)
        return place + 1

    def _set_local(self, values: dict[str, float]) -> None:
        for key in [key for key in self.variables if is_local(key)]:
            del self.variables[key]
        self.variables.update(values)

    def _leave(self, index: int) -> int:
        if not self.calls:
            return len(self.listing.statements)  # M99 of a main program: once is enough
        return_index, local, name, repeats_left = self.calls.pop()
        if repeats_left > 0:
            self.calls.append((return_index, local, name, repeats_left - 1))
            return self.listing.programs[str(int(name)) if name.isdigit() else name] + 1
        if local is not None:
            self._set_local(local)
        return return_index
