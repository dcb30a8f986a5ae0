"""Every kind of page in a browser, wide and on a phone, light, dark and in print: nothing cut, nothing over other text, no
text too faint, nothing asked of a host; it begins with its answer and ends with what it rests on, in the words of a shop."""

from __future__ import annotations

import re
import warnings
from pathlib import Path

import page_cases
import pytest

BOXES = Path(__file__).with_name("boxes.js").read_text(encoding="utf-8")
CONTRAST = (Path(__file__).parents[1] / "workbench/contrast.js").read_text(encoding="utf-8")
LARGEST = 1.6e6  # bytes
# Every width in light and dark, and print from both; a sheet is as wide as its paper whatever the screen.
VIEWS = tuple((f"{name}, {scheme}", width, scheme, media) for name, width, media in (
    ("wide", 1400, "screen"), ("phone", 390, "screen"), ("print", 680, "print")) for scheme in ("light", "dark"))
# What only a programmer reads: calls, dunder names, carets, spelled-out micro and plus-minus.
UNPRINTABLE = (r"\b[A-Z][A-Za-z]+\([^)]*[=(]", r"\bnan\b", r"\binf\b", r"\d um\b", r", um\b", r"N/um", r"\+-", r"\^\d",
               r"array\(", r"\bNone\b", r"\bTrue\b", r"\bdeg\b")


def faults_at_rest(seen, *, printed):
    """What is cut or lies over other text, once two looks agree: charts draw themselves anew after a change of width."""
    before = None
    for look in range(100):
        seen.page.wait_for_timeout(300)
        seen.wait_for_frames()
        faults = seen.page.evaluate(f"({BOXES})({str(printed).lower()})")
        if faults == before and (not faults or look > 20):
            return faults
        before = faults
    return before


@pytest.mark.slow
@pytest.mark.browser
@pytest.mark.parametrize("name", page_cases.CASES)
def test_page(name, opened):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        report = page_cases.CASES[name]()
    html = report.html()
    assert len(html.encode()) <= LARGEST
    assert len(report.summary.split()) >= 5, "a page begins with its answer"
    titles = [section.title for section in report.sections]
    assert report.assumptions or "assum" in titles[-1].lower(), "a page ends with what it rests on"
    assert all(section.parts for section in report.sections), "no empty card"
    seen = opened(html, reduced_motion="reduce")
    seen.wait("document.querySelectorAll('.tp-chart').length === Object.keys(window.toolpointCharts).length")
    words = seen.page.evaluate("(() => { document.querySelectorAll('details').forEach((d) => d.remove());"
                               " return document.body.innerText; })()")
    assert [found.group(0) for pattern in UNPRINTABLE for found in re.finditer(pattern, words)] == []
    unlabelled = seen.page.evaluate("document.querySelectorAll('.tp-chart:not([aria-label]), canvas:not([aria-label]), "
                                    "img:not([alt])').length")
    assert unlabelled == 0
    for view, width, scheme, media in VIEWS:
        seen.page.set_viewport_size({"width": width, "height": 1000})
        seen.page.emulate_media(media=media, color_scheme=scheme)
        seen.page.evaluate(f"window.dispatchEvent(new Event('{'beforeprint' if media == 'print' else 'afterprint'}'))")
        assert faults_at_rest(seen, printed=media == "print") == [], view
        if media == "screen":
            assert seen.page.evaluate(CONTRAST) == [], view
    assert seen.errors == []
    assert len(seen.requests) == 1 and seen.requests[0].startswith("file:")


def test_every_page_of_the_package_is_among_the_cases():
    """A new page function is looked at too: its name stands in the cases."""
    source = Path(page_cases.__file__).read_text(encoding="utf-8")
    import toolpoint.pages

    assert {name for name in toolpoint.pages.__all__ if name not in source} == set()
