"""Faults and notes of a program while it is read."""

from __future__ import annotations

from dataclasses import dataclass, field

from toolpoint.io.faults import Fault


@dataclass
class Remarks:
    """Faults and notes while a program is read: the same words in many lines are one, with the number of lines."""

    faults: dict[str, list[tuple[int, int]]] = field(default_factory=dict)
    without_motion_words: dict[str, set[int]] = field(default_factory=dict)
    notes: dict[str, set[int]] = field(default_factory=dict)
    place: str = ""  # in a file beside the program, in words
    count: int = 0  # of faults, equal ones too
    look_ahead: str = ""  # word by which the control is told to pass over bottlenecks of a compensated contour

    def fault(self, number: int, column: int, message: str) -> None:
        """Keep a fault."""
        self.count += 1
        message, column = message + self.place, 1 if self.place else column
        places = self.faults.setdefault(message, [])
        if (number, column) not in places:
            places.append((number, column))

    def without_motion(self, number: int, word: str) -> None:
        """Keep a word that moves nothing."""
        self.without_motion_words.setdefault(word, set()).add(number)

    def note(self, number: int, message: str) -> None:
        """Keep what was assumed or left out."""
        self.notes.setdefault(message, set()).add(number)

    def fault_list(self) -> list[Fault]:
        """Return the faults, each at its first line."""
        faults = []
        for message, places in self.faults.items():
            lines = len({number for number, _ in places})
            count_words = f" (in {lines} lines)" if lines > 1 else ""
            # The first place stands for all: a missing word on every line of a program is one slip, not ten thousand.
            faults.append(Fault(*places[0], "", message + count_words))
        return sorted(faults, key=lambda f: f.line)[:100]

    def note_list(self) -> tuple[str, ...]:
        """Return the notes; all words without motion in one."""
        notes = [f"{message} ({_lines(numbers)})" for message, numbers in self.notes.items()]
        if self.without_motion_words:
            words = ", ".join(f"{word} in {len(numbers)} line" + "s" * (len(numbers) > 1)
                              for word, numbers in self.without_motion_words.items())
            notes.append(f"words without motion are passed over: {words}")
        return tuple(notes)


def _lines(numbers: set[int]) -> str:
    first = sorted(numbers)
    return f"line {first[0]}" if len(first) == 1 else f"lines {', '.join(map(str, first[:3]))}" + \
        (f" and {len(first) - 3} more" if len(first) > 3 else "")
