"""Words of the workbench by language: every key in every language, and every key that a script asks for."""

import json
import re

from toolpoint.workbench.web.assets import LANGUAGES, SENTENCES, web_file


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
