"""Citation of the package: what to write in a paper, as a sentence and as BibTeX."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from toolpoint._notebook import NotebookText

CITED_TITLE = "toolpoint: machine-tool dynamics from hammer test to chatter limits"
CITED_AUTHORS, CITED_YEAR, CITED_LICENSE = "The toolpoint developers", 2026, "BSD-3-Clause"


@dataclass(frozen=True)
class Citation(NotebookText):
    """Citation of the package in its installed version.

    Examples
    --------
    >>> Citation("0.1.0").to_dict()["license"]
    'BSD-3-Clause'
    """

    version: str

    def table(self) -> str:
        """Return the sentence and the BibTeX entry, and what else belongs into a paper."""
        return "\n".join([
            f"{CITED_AUTHORS} ({CITED_YEAR}): {CITED_TITLE}, version {self.version}.", "", self.bibtex(), "",
            "Also cite the methods that your result rests on: the notes of the result and the page of its theory name their "
            "sources.", "A result can be made again only with the version, the input files and the command: state them."])

    def bibtex(self) -> str:
        """Return the BibTeX entry."""
        return (f"@software{{toolpoint,\n  author = {{{{{CITED_AUTHORS}}}}},\n  title = {{{CITED_TITLE}}},\n"
                f"  version = {{{self.version}}},\n  year = {{{CITED_YEAR}}},\n  license = {{{CITED_LICENSE}}}\n}}")

    def to_dict(self) -> dict[str, Any]:
        """Return authors, title, year, version, license and the BibTeX entry as plain data."""
        return {"authors": CITED_AUTHORS, "title": CITED_TITLE, "year": CITED_YEAR, "version": self.version,
                "license": CITED_LICENSE, "bibtex": self.bibtex()}


def cite_package() -> Citation:
    """Return the citation of the installed version.

    Examples
    --------
    >>> "The toolpoint developers" in cite_package().table()
    True
    """
    from toolpoint import __version__

    return Citation(__version__)
