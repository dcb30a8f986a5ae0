"""Programs whose loops never end are refused at once, with the line; loops that end run, however often."""

import pytest

from toolpoint import ToolpointError
from toolpoint.io.program import gcode
from toolpoint.io.program.klartext import reader
from toolpoint.io.program.language import interpreter

HEAD = "G21 G90 G17\n"


@pytest.mark.slow
@pytest.mark.parametrize(("text", "words"), [
    (HEAD + "#1=0\nWHILE [#1 LT 3] DO1\nG1 X[#1*10] F500\nEND1\nM30\n", "a loop without end: 1000 passes changed no variable"),
    (HEAD + "#1=0\nWHILE [#1 GT -1] DO1\n#1=[#1+1]\nEND1\nM30\n", "lines are run: a loop without end"),
    ("%\nO1\n" + HEAD + "M98 P2\nM30\nO2\nM98 P2 L3\nM99\n%\n", "nested more than 20 deep"),
])
def test_a_loop_without_end_is_named(text, words):
    with pytest.raises(ToolpointError, match=words):
        gcode.parse(text)


@pytest.mark.slow
def test_a_long_loop_that_ends_runs():
    program = gcode.parse(HEAD + "#1=0\nWHILE [#1 LT 5000] DO1\nG1 X#1 F500\n#1=[#1+1]\nEND1\nM30\n")
    assert program.end[-1][0] == pytest.approx(4.999)


@pytest.mark.parametrize("text", [
    HEAD + "#1=0\nWHILE [#1 LT 1000000] DO1\n#1=#1+1\nG1 X[#1" + "+#1*2" * 100 + "] F100\nEND1\nM30\n",
    "BEGIN PGM A MM\nQ1 = 0\nLBL 1\nQ1 = Q1 + 1\nQ2 = Q1" + " + Q1 * 2" * 100
    + "\nFN 12: IF +Q1 LT +1000000 GOTO LBL 1\nEND PGM A MM\n"])
def test_loops_are_bounded_by_the_characters_they_run(text, monkeypatch):
    """A loop of long expressions may run no longer than one of short lines: the work is counted, not the lines alone."""
    for module in (interpreter, reader):
        monkeypatch.setattr(module, "MAX_LOOP_CHARACTERS", 20_000)
    with pytest.raises(ToolpointError, match="characters are run: a loop without end") as caught:
        gcode.parse(text)
    assert str(caught.value).count("characters are run") == 1
