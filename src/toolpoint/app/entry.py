"""Start of a command's process: Ctrl-C and plain output first, before anything that takes long to load."""

from __future__ import annotations

import _signal  # of the interpreter itself: the module around it takes twenty milliseconds to load
import gc
import os

# 128 and the signal's number, as `interrupt` ends a command, which is not loaded yet.
_signal.signal(_signal.SIGINT, lambda number, frame: os._exit(128 + number))

# Objects made between two searches for garbage. A compiler keeps nearly all that it makes: with the 700 of the interpreter the
# searches take a twelfth of a first use.
_OBJECTS_BETWEEN_SEARCHES = 100_000
gc.set_threshold(_OBJECTS_BETWEEN_SEARCHES, *gc.get_threshold()[1:])


def main() -> None:
    """Run the command line as a process of its own."""
    from toolpoint.app.interrupt import end_on_interrupt, ignore_interrupts

    end_on_interrupt()
    from toolpoint.app.main import main as command
    from toolpoint.app.plain_output import spell_plainly

    spell_plainly()
    try:
        command()
    finally:
        ignore_interrupts()
