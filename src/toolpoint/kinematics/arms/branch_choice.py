"""Branches of an arm by name, and a choice among them: some of the three words, or the wrist turned least."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

from toolpoint._check import fail

# The two words for each part of an arm; `SphericalWrist.branch_name` says what they mean.
SHOULDERS, ELBOWS, WRISTS = ("front", "back"), ("up", "down"), ("no flip", "flip")
BRANCHES = tuple(" ".join(words) for words in product(SHOULDERS, ELBOWS, WRISTS))
LEAST_TURNED = "wrist turned least"
# Words that a text may hold beside those of a branch, and that decide nothing.
_FILLERS = ("shoulder", "elbow", "wrist", "turned", "and")


@dataclass(frozen=True)
class BranchChoice:
    """Choice among the branches of an arm.

    shoulder, elbow, wrist : word of the wanted branches, any where empty; is_least : whether, of the branches that remain at a
    place, the one is taken that turns the three axes of the wrist least from the reference pose.

    Examples
    --------
    >>> BranchChoice.parsed("front, elbow up").allows("front up no flip")
    True
    """

    shoulder: str = ""
    elbow: str = ""
    wrist: str = ""
    is_least: bool = False

    @classmethod
    def parsed(cls, text: str) -> BranchChoice:
        """Return the choice of a text such as ``front up no flip``, ``front, elbow up`` or ``front, elbow up, wrist turned
        least``; all branches where it is empty.

        Raises ToolpointError for other words, and for two words on one thing, with the branches that there are.
        """
        words = text.lower().replace(",", " ").split()
        joined = " ".join(word for word in words if word not in _FILLERS).replace("no flip", "no_flip").split()
        chosen: dict[str, str] = {}
        for word in joined:
            name = word.replace("_", " ")
            part = next((part for part, names in (("shoulder", SHOULDERS), ("elbow", ELBOWS), ("wrist", (*WRISTS, "least")))
                         if name in names), "")
            if not part or part in chosen:
                _refuse(text)
            chosen[part] = name
        if text.strip() and not chosen:
            _refuse(text)
        is_least = chosen.get("wrist") == "least"
        return cls(chosen.get("shoulder", ""), chosen.get("elbow", ""), "" if is_least else chosen.get("wrist", ""), is_least)

    def allows(self, name: str) -> bool:
        """Whether the branch of this name, such as ``front up no flip``, has the chosen words; `is_least` is not looked at."""
        shoulder, elbow, wrist = name.split(" ", 2)
        return all(not word or word == chosen for word, chosen in (
            (self.shoulder, shoulder), (self.elbow, elbow), (self.wrist, wrist)))


def _refuse(text: str) -> None:
    """Raise ToolpointError for a text that names no branch, with all branch names."""
    fail("`branch`", repr(text), f"must be of {', '.join(BRANCHES)}",
         remedy=f"some of the words will do, as 'front up', and '{LEAST_TURNED}' in place of the last: 'front, elbow up, "
                f"{LEAST_TURNED}'")
