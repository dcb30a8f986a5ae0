"""Words of the workbench by language: every key in every language, and every key that a script asks for."""

import json
import re
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from spoken_sentences import Catalogue
from toolpoint.workbench.web.assets import LANGUAGES, SENTENCES, web_file

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "docs"))
from generate.sites import doubts_of

# Rooms whose doubts a project can carry; those of the others are of commands that the workbench has no view of.
PROJECT_ROOMS = ("cutting", "io", "joint_identification", "machine", "modal_identification", "project", "signals",
                 "substructuring", "updating", "workbench")
MAX_ENGLISH_DOUBTS = 12  # kinds put together from sentences of other parts; `german_doubts.txt` has each as it is said


def test_every_language_has_every_word_with_the_same_places_for_numbers():
    """English is complete, German and French have its keys, and a sentence keeps the numbers that stand in it."""
    english = json.loads(web_file("words_en.json"))
    for language in LANGUAGES[1:]:
        words = json.loads(web_file(f"words_{language}.json"))
        assert words.keys() == english.keys(), language
        for key, text in english.items():
            assert set(re.findall(r"\{\w+\}", words[key])) == set(re.findall(r"\{\w+\}", text)), (language, key)
    used = set(re.findall(r'W\.word\("([\w.-]+)"', web_file("bundle.js").decode("utf-8")))
    assert {key for key in used if not key.endswith((".", "-"))} <= english.keys()


def test_sentences_keep_their_places_and_none_stands_twice():
    pairs = json.loads(web_file(SENTENCES))
    assert len(pairs) >= 70 and len({said for said, _ in pairs}) == len(pairs)
    for said, words in pairs:
        places = re.findall(r"\{(\w+)\}", said)
        assert sorted(places) == sorted(re.findall(r"\{(\w+)\}", words)) and len(set(places)) == len(places), said


def english_kinds(catalogue, kinds):
    """Return the kinds of doubt that a catalogue lacks; a number stands for what the program puts in."""
    said = {kind: f"{kind.seen}; {kind.cure}".removesuffix("; ").replace("…", "7") for kind in kinds}
    return [kind for kind, text in said.items() if catalogue.translate(text) is None]


def test_doubts_of_a_project_are_german_but_for_few():
    """The message names those that are not: a new kind of doubt needs its sentence in the catalogue."""
    kinds = doubts_of(PROJECT_ROOMS)
    missing = english_kinds(Catalogue("de"), kinds)
    assert len(kinds) > 150
    assert len(missing) <= MAX_ENGLISH_DOUBTS, [f"{kind.module}:{kind.line}: {kind.seen}; {kind.cure}" for kind in missing]


def test_a_new_kind_of_doubt_is_counted():
    kind = next(site for site in doubts_of(["joint_identification"]) if site.seen.startswith("stiffness: it is"))
    assert english_kinds(Catalogue("de"), [kind]) == []
    for new in (replace(kind, seen="stiffness: the hinges squeak at … Hz"), replace(kind, cure="oil them")):
        assert english_kinds(Catalogue("de"), [new]) == [new]


@pytest.mark.parametrize(("said", "words"), [
    ("stiffness of a-b: it is 1.4e+03 times that of the stiffest other joint: the test does not determine it; describe the "
     "two components as one, or excite the joint more",
     "Steifigkeit von a-b: sie ist das 1.4e+03-Fache der steifsten anderen Fügestelle: Der Versuch bestimmt sie nicht; "
     "die beiden Bauteile als eines beschreiben oder die Fügestelle stärker anregen"),
    ("mode 2 at 39.8 Hz: its half-power width of 0.4 Hz holds fewer than three lines; measure longer for a finer line spacing",
     "Mode 2 bei 39.8 Hz: ihre Halbwertsbreite von 0.4 Hz enthält weniger als drei Linien; länger messen, damit die Linien "
     "enger liegen"),
])
def test_numbers_and_names_of_a_doubt_stay(said, words):
    assert Catalogue("de").translate(said) == words


def test_doubts_put_together_from_sentences_are_german():
    """Their parts vary, so the count of kinds passes them over: each as it is said, with all that may stand in it."""
    catalogue = Catalogue("de")
    said = (Path(__file__).parent / "german_doubts.txt").read_text(encoding="utf-8").splitlines()
    assert len(said) > 20
    translated = {text: catalogue.translate(text) for text in said}
    assert [text for text, words in translated.items() if words is None] == []
    english = re.compile(r"\b(the|is|are|by|within|which|with)\b")
    assert {text: words for text, words in translated.items() if english.search(words)} == {}
