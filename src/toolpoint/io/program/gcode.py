"""Programs of machine tools -> path segments: G-code of ISO 6983 as Fanuc, Siemens and LinuxCNC write it; Klartext by its kind.

Motion: G0 G1 G2 G3, G17-G19, G90/G91, AC() and IC(), I J K, CR= or R; units G20/G21, G70/G71, G700/G710; feeds G93-G97; exact
stop G9, G60, G61, G64; dwell G4; drilling cycles G73, G76, G81-G89; G28, G30, G53, G54-G59, G10 L2, G52, G92. Frames: TRANS,
ROT, SCALE, MIRROR and their additive kinds, G68, G69, G51.1, G50.1 (`control.frame`). Siemens drilling cycles CYCLE81 to 89 and
840, their patterns, and MCALL (`iso.siemens_cycles`). Variables, expressions, jumps, loops and subprograms of the same file
(`language.statements`). Radius compensation (G41, G42, RL, RR; `path.radius_compensation`), polar places (G16), scales (G51).
Words that move nothing are one note; what would bend the path (splines, threads) is a fault by name.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

from toolpoint._check import ToolpointError
from toolpoint._doubt import Doubt
from toolpoint.drives.program.path import Path as DrivePath
from toolpoint.io.door import door
from toolpoint.io.faults import Fault, FileFaults
from toolpoint.io.program.control.modes import ControlModes
from toolpoint.io.program.control.tool_centre import begin_control
from toolpoint.io.program.iso.block import BlockReader
from toolpoint.io.program.language.files_beside import FilesBeside
from toolpoint.io.program.language.interpreter import Run
from toolpoint.io.program.language.remarks import Remarks
from toolpoint.io.program.language.statements import list_statements
from toolpoint.io.program.path.radius_compensation import CutterRadii
from toolpoint.io.program.path.segments import Program

__all__ = ["Program", "parse", "read", "read_path"]

# Some millions of lines: programs of moulds have as many, a film or a disk image that was named by mistake has more.
_MAX_PROGRAM_BYTES = 200_000_000
MAX_FOREIGN, _HEAD_CHARACTERS = 0.2, 4000  # share of the characters at the begin of a file that may be no text
MAX_FAULTY, FEWEST_FAULTY = 0.5, 4  # share of the lines of a program that may be no blocks; lines from which they are counted
Point = tuple[float, float, float]
# How a program ends; and how many of its last lines are looked at, behind which empty numbered ones may stand.
_END_WORDS = re.compile(r"(?<![A-Z])M\s*0*(?:2|30|99|17)(?!\d)|\bRET\b|\bEND PGM\b|^\s*%\s*$|\bENDSUB\b")
_LAST_LINES = 5


@door("program")
def read(path: str | Path, rapid_feed: float = 0.5, start: Point = (0.0, 0.0, 0.0), *, feed: float | None = None,
         cutter_radius: CutterRadii | float | None = None, tip_programmed: bool = False) -> Program:
    r"""Return the segments of a program file; see `parse`. Files named .h, or that begin with BEGIN PGM, are Klartext.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "line.nc")
    ...     _ = file.write_text("S9000 M3\nG1 X30 Y40 F6000\n")
    ...     read(file).end.tolist()
    [[0.03, 0.04, 0.0]]
    """
    path = Path(path)
    try:
        if path.stat().st_size > _MAX_PROGRAM_BYTES:
            raise ToolpointError(f"{path}: {path.stat().st_size / 1e6:.0f} MB; at most {_MAX_PROGRAM_BYTES / 1e6:.0f} are "
                                 f"read; cut it")
        text = path.read_text(encoding="utf-8-sig", errors="replace")
    except OSError as error:
        raise ToolpointError(f"{path}: cannot be read ({error.strerror}); check the name and the folder") from None
    program = parse(text, rapid_feed, start, name=str(path), feed=feed, cutter_radius=cutter_radius,
                    tip_programmed=tip_programmed, neighbours=FilesBeside(path))
    doubts = question_end(text, is_cutting=not program.rapid[-1])
    return replace(program, notes=(*doubts, *program.notes))


def question_end(text: str, *, is_cutting: bool) -> list[Doubt]:
    """Return a doubt where a program has no end (M2, M30, M99, RET, END PGM, %) behind its last block, as a file cut off has.

    is_cutting : whether the last block leaves the tool in a cut.
    """
    lines = [line for line in re.sub(r"\([^)]*\)|;[^\n]*", "", text.upper()).splitlines() if line.strip()]
    if not lines or any(_END_WORDS.search(line) for line in lines[-_LAST_LINES:]):
        return []
    return [Doubt("end of the program", f"no M2, M30, M99, RET or END PGM stands in its last lines, the last is "
                  f"'{lines[-1].strip()[:60]}'" + (", and the tool stays in the cut" if is_cutting else ""),
                  "is the file whole?", grave=is_cutting)]


def question_subprograms(run: Run) -> list[Doubt]:
    """Return doubts about subprograms that are not there, and about those that stand in files of their own."""
    doubts = [Doubt("subprogram", f"{name.strip('<>')} (line {line}) is neither in the program nor in a file beside it: its "
                    "motion is left out, and with it what it cuts", "put its file into the folder of the program", grave=True)
              for name, line in run.absent.items()]
    return doubts + [Doubt("subprogram file", f"{file} is run where line {line} calls it; its moves are told by that line, and "
                           "its words S and F are not written anew") for file, line in run.files.items()]


def read_path(path: str | Path, rapid_feed: float = 0.5, *, cutter_radius: float | None = None) -> DrivePath:
    r"""Return the path of lines and arcs that a program file describes; `rapid_feed` (m/s) is that of G0,
    `cutter_radius` (m) that of radius compensation.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "line.nc")
    ...     _ = file.write_text("G1 X30 Y40 F6000\n")
    ...     read_path(file).end.tolist()
    [[0.03, 0.04, 0.0]]
    """
    return read(path, rapid_feed, cutter_radius=cutter_radius).path


def parse(text: str, rapid_feed: float = 0.5, start: Point = (0.0, 0.0, 0.0), *, name: str = "program",
          arc_tolerance: float = 1e-5, feed: float | None = None, cutter_radius: CutterRadii | float | None = None,
          tip_programmed: bool = False, neighbours: FilesBeside | None = None) -> Program:
    """Return the segments of a program.

    Parameters
    ----------
    text : str
        Millimetres and mm/min unless G70 (inches), G20 or G700 (inches and inch/min).
    rapid_feed : float
        Feed of G0, m/s.
    start : 3 floats
        Position before the first line, m.
    name : str
        Shown in faults.
    arc_tolerance : float
        Largest difference of the radii at an arc's start and end, m; in programs in inches 25.4 times as much.
    feed : float, optional
        m/s; of cuts before the first F.
    cutter_radius : CutterRadii or float, optional
        m; of the tools, for G41 and G42, RL and RR: zero where the program holds the path of the tool's centre.
    tip_programmed : bool
        Whether X, Y and Z are the tip's from the first line on, as under tool centre control: a machine of LinuxCNC whose
        kinematics hold the tip needs no word for it.
    neighbours : FilesBeside, optional
        Where subprograms are looked for that are not in the text. Their moves have the line that calls them.

    Raises
    ------
    FileFaults
        Every faulty line: unknown words, two words of a group, an arc with a wrong radius or without centre, no feed.
    """
    from toolpoint.io.program.klartext import reader as klartext

    _check_text(name, text)
    remarks = Remarks()
    state = ControlModes(rapid_feed, arc_tolerance, [float(x) for x in start], remarks, feed=feed or 0.0)
    state.segments.cutter_radii = CutterRadii(cutter_radius) if isinstance(cutter_radius, float | int) else cutter_radius
    if tip_programmed:
        begin_control(state, 1, "of the machine")
    if klartext.is_klartext(text):
        return klartext.run(text, state, name)
    without_suffix = re.sub(r"\([^)]*\)|;.*", "", text.upper())
    if re.search(r"G96(?!\d)|\bDIAMON\b", without_suffix) and not re.search(r"G9[45](?!\d)", without_suffix):
        state.turning, state.feed_mode = True, 95
        remarks.note(1, "a turning program (G96 without G94 or G95): X and U are diameters, F is mm per revolution")
    variables: dict[str, float] = {}
    unset: set[str] = set()
    reader = BlockReader(state, variables, unset)
    run = Run(list_statements(text), remarks, reader.take, variables, unset, neighbours=neighbours)
    run.execute()
    remarks.place = ""
    state.segments.doubts += question_subprograms(run)
    _check_kind(name, text, state, remarks)
    if re.search(r"#5[04]\d\d", without_suffix):
        remarks.note(1, "the program reads where the machine stands (#5021 and the like): it is where this program brought it, "
                     "an operator moves nothing")
    _tell(reader, remarks)
    return state.segments.program(name, text, words=reader.words, remarks=remarks)


def _check_text(name: str, text: str) -> None:
    """Refuse a file of another kind in one fault: many of its characters are none of a text."""
    head = text[:_HEAD_CHARACTERS]
    foreign = sum(c == "\ufffd" or (c < " " and c not in "\t\r\n\f\v") for c in head)
    # Punched leaders and codes of a serial line are a few.
    if foreign > MAX_FOREIGN * max(len(head), 1):
        raise FileFaults(name, text, [Fault(
            1, 1, "", f"no NC program: {foreign} of its first {len(head)} characters are none of a text (a binary file?); give "
            "the program that the control runs")])


def _check_kind(name: str, text: str, state: ControlModes, remarks: Remarks) -> None:
    """Refuse a text that is no program, in one fault: most of its lines are no blocks."""
    lines = [number for number, line in enumerate(text.splitlines(), 1) if line.strip()]
    faulty = {number for message, places in remarks.faults.items() if "is not computed" not in message for number, _ in places}
    if len(faulty) <= MAX_FAULTY * max(len(lines), 1) or len(faulty) < FEWEST_FAULTY or len(state.segments.rows) > len(faulty):
        return
    raise FileFaults(name, text, [Fault(
        min(faulty), 1, "", f"no NC program: {len(faulty)} of {len(lines)} lines are no blocks of G-code (ISO, Fanuc, "
        "Siemens), and it does not begin with BEGIN PGM as Klartext does; give the program that the control runs")])


def _tell(reader: BlockReader, remarks: Remarks) -> None:
    """Note the rotary words and the variables that the program reads from outside."""
    if reader.turned:
        for number in reader.turned:
            remarks.note(number, "A, B, C move together with X, Y, Z: the path is that of X, Y, Z alone")
    for number in reader.rotary:
        remarks.note(number, "rotary words (A, B, C) only position and are passed over")
    if reader.unset:
        names = ", ".join(sorted(reader.unset)[:8])
        remarks.note(1, f"variables that the program does not set are zero: {names}")
