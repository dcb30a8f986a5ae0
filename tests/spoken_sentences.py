"""Catalogue of sentences as the page applies it (`words.js`), for tests that have no browser."""

from __future__ import annotations

import json
import re

from toolpoint.workbench.web.assets import web_file

PLACE = r"(?:(?!; |[.?!] [A-Z0-9]).)+?"
LONGEST_NAME = 60
SPLITS = ((r"(?<=[.?!]) (?=[A-Z0-9])", " "), ("; ", "; "))


class Catalogue:
    """Sentences of a language."""

    def __init__(self, language: str) -> None:
        self.pairs = [(self._pattern(said), words) for said, words in json.loads(web_file(f"sentences_{language}.json"))]

    @staticmethod
    def _pattern(said: str) -> re.Pattern[str]:
        places = {"z": ".+", "l": ".+?", "m": "[^:;]+?", "n": "[^:;]+?"}
        parts = re.split(r"\{(\w)\}", said)
        return re.compile("".join(f"(?P<{part}>{places.get(part, PLACE)})" if number % 2 else re.escape(part)
                                  for number, part in enumerate(parts)) + r"\Z")

    def translate(self, text: str) -> str | None:
        """Return a text in the language, None where the catalogue lacks a part of it."""
        text = text.replace(" .. ", " … ")
        for pattern, template in self.pairs:
            match = pattern.match(text)
            if match is None:
                continue
            values = match.groupdict()
            if "z" in values and self.translate(values["z"]) is None:
                continue
            return template.format(**{name: self.translate(value) or value for name, value in values.items()})
        for mark, joint in SPLITS:
            parts = re.split(mark, text)
            translated = [self.translate(part) for part in parts] if len(parts) > 1 else [None]
            if None not in translated:
                return joint.join(part for part in translated if part is not None)
        head, colon, rest = text.partition(": ")
        words = self.translate(rest) if colon and len(head) < LONGEST_NAME and "; " not in head else None
        if words is not None:
            return f"{self.translate(head) or head}: {words}"
        words = self.translate(text[:-1]) if text.endswith(".") else None
        return None if words is None else f"{words}."
