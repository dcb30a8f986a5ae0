import json
import pickle

import pytest

from toolpoint._doubt import Doubt, status_of

DOUBT = Doubt("limits", "the stated error is 37 % of the limit", "average more hits", figure=0.37)


def test_a_doubt_is_its_sentence_and_keeps_its_parts():
    assert DOUBT == "limits: the stated error is 37 % of the limit; average more hits"
    assert json.loads(json.dumps([DOUBT])) == [str(DOUBT)]
    assert (DOUBT.what, DOUBT.remedy, DOUBT.figure) == ("limits", "average more hits", 0.37)
    assert str(Doubt("foot", "no place is given")) == "foot: no place is given"


def test_a_doubt_of_a_part_names_it_first():
    of_axis = DOUBT.within("axis X")
    assert of_axis == f"axis X: {DOUBT}" and (of_axis.what, of_axis.figure) == ("axis X: limits", 0.37)


def test_a_doubt_travels_to_other_processes_whole():
    again = pickle.loads(pickle.dumps(DOUBT))
    assert again == DOUBT and vars(again) == vars(DOUBT) and isinstance(again, Doubt)


def test_a_doubt_cannot_be_changed():
    with pytest.raises(AttributeError, match="cannot be changed"):
        DOUBT.figure = 0.0


def test_a_status_is_made_from_doubts():
    assert status_of([], "complete") == "complete"
    assert status_of([DOUBT, DOUBT], "complete") == f"doubtful: {DOUBT}"
