"""ProgramView: the path of a program on a page, with a slider of time, a choice of colours, its text and lobes of blocks."""

from __future__ import annotations

import html
import json
import re
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint.plot.figures.theme import RAMP
from toolpoint.plot.page.frame import deflate_block
from toolpoint.plot.shape_view.view import pack_array

PROGRAM_SCRIPT = "program_view.js"
MAX_FINE_BLOCKS = 20_000  # blocks whose values are kept in 16 bits; of more in 8


@dataclass(frozen=True, eq=False)
class BlockQuantity:
    """Quantity of blocks (n,) to colour by, not a number where not known; upper : end of the colours, at least the largest."""

    name: str
    unit: str
    values: FloatArray
    upper: float = 0.0
    digits: int = 3

    @property
    def end(self) -> float:
        """Value at the end of the colours."""
        known_values = np.abs(self.values[np.isfinite(self.values)])
        return max(self.upper, float(known_values.max(initial=0.0)), 1e-12)


@dataclass(frozen=True, eq=False)
class BlockLobes:
    """Stable depth (m) over the spindle speed (rev/min) of the blocks (k,) that share an engagement; not a number above the
    depths that were searched. depth (m), now (rev/min): of the worst of them.

    >>> lobes = BlockLobes(np.array([3, 4]), np.array([8000.0, 9000.0]), np.array([1e-3, np.nan]), 8e-4, 8500.0)
    >>> lobes.blocks.tolist(), lobes.now
    ([3, 4], 8500.0)
    """

    blocks: np.ndarray
    speed: FloatArray
    limit: FloatArray
    depth: float
    now: float


@dataclass(frozen=True, eq=False)
class ProgramView:
    """The path of a program, drawn by WebGL2 from one polyline.

    On the page, `window.toolpointPrograms[name]` has choose(quantity), showUntil(time), select(block) and frames.

    Parameters
    ----------
    name : str
        Letters, digits, ``_`` and ``-``, the first a letter.
    points : (n + 1, 3) floats
        Ends of the drawn pieces, m.
    block : (n,) ints
        Segment of every piece; rising.
    kind : (blocks,) ints
        0 rapid, 1 feed in air, 2 cutting.
    time : (blocks,) floats
        Time at which every block ends, s.
    line : (blocks,) ints
        Line of the text.
    quantities : sequence of BlockQuantity
    text : sequence of str
        Lines of the program.
    verdict : (blocks,) ints, words of it
    surface : (nodes (m, 3), triangles (k, 3))
        The work as it is left.
    lobes : sequence of BlockLobes
    """

    name: str
    points: FloatArray
    block: np.ndarray
    kind: np.ndarray
    time: FloatArray
    line: np.ndarray
    quantities: Sequence[BlockQuantity]
    text: Sequence[str] = ()
    verdict: np.ndarray = field(default_factory=lambda: np.zeros(0, int))
    verdicts: Sequence[str] = ()
    surface: tuple[FloatArray, np.ndarray] = field(default_factory=lambda: (np.zeros((0, 3)), np.zeros((0, 3), int)))
    lobes: Sequence[BlockLobes] = ()
    caption: str = ""

    def __post_init__(self) -> None:
        if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_-]*", self.name):
            fail("ProgramView.name", repr(self.name), "must be letters, digits, _ and -, the first a letter")
        if len(self.points) != len(self.block) + 1:
            fail("ProgramView.points", f"{len(self.points)} for {len(self.block)} pieces", "must be one more than pieces")
        for quantity in self.quantities:
            if len(quantity.values) != len(self.kind):
                fail("ProgramView.quantities", f"{len(quantity.values)} values of {quantity.name}",
                     f"must be those of the {len(self.kind)} blocks")

    def payload(self) -> dict[str, object]:
        """Return what the script reads: packed arrays."""
        nodes, triangles = self.surface
        places = np.concatenate([self.points, nodes]) if len(nodes) else self.points
        lower, size = places.min(axis=0), max(float(np.ptp(places, axis=0).max()), 1e-9)
        levels = [self._levels(quantity) for quantity in self.quantities]
        return {
            "ramp": RAMP, "lower": lower.tolist(), "size": size,
            "points": pack_array(np.rint((self.points - lower) / size * 65535), "<u2"),
            "block": pack_array(np.diff(self.block, prepend=0), "<u2"), "kind": pack_array(self.kind, "u1"),
            "time": pack_array(np.diff(self.time, prepend=0.0), "<f4"), "line": pack_array(self.line, "<u4"),
            "verdict": pack_array(self.verdict if len(self.verdict) else np.zeros(len(self.kind), int), "u1"),
            "verdicts": list(self.verdicts) or [""],
            "nodes": pack_array(np.rint((nodes - lower) / size * 65535), "<u2"), "triangles": pack_array(triangles, "<u4"),
            "quantities": [{"name": q.name, "unit": q.unit, "end": float(f"{q.end:.6g}"), "digits": q.digits,
                            "levels": packed, "coarse": coarse}
                           for q, (packed, coarse) in zip(self.quantities, levels, strict=True)],
            "lobes": [{"blocks": each.blocks.tolist(), "speed": _short(each.speed), "limit": _short(1e3 * each.limit),
                       "depth": _short(np.array([1e3 * each.depth]))[0], "now": _short(np.array([each.now]))[0]}
                      for each in self.lobes],
            "text": "\n".join(self.text)}

    def _levels(self, quantity: BlockQuantity) -> tuple[dict[str, object], bool]:
        """Return the values as whole levels from 1 of the end of the colours, 0 where not known."""
        coarse = len(self.kind) > MAX_FINE_BLOCKS
        level_max = 255 if coarse else 65535
        share = np.abs(np.where(np.isfinite(quantity.values), quantity.values, 0.0)) / quantity.end
        level = np.where(np.isfinite(quantity.values), 1 + np.rint(share * (level_max - 1)), 0)
        return pack_array(level, "u1" if coarse else "<u2"), coarse

    def fragment(self) -> str:
        """Return the HTML of the view without scripts: a figure and its data block."""
        source = f"tp-program-{self.name}"
        caption = f"<figcaption>{html.escape(self.caption)}</figcaption>" if self.caption else ""
        return (f'<figure class="tp-figure"><div class="tp-program" data-name="{self.name}" data-source="{source}">'
                f"<noscript>This view needs JavaScript, which is switched off.</noscript></div>{caption}</figure>"
                + deflate_block(source, json.dumps(self.payload(), separators=(",", ":"), allow_nan=False)))

    def __repr__(self) -> str:
        return f"ProgramView({self.name!r}, {len(self.kind)} blocks, {len(self.quantities)} quantities)"


def _short(values: FloatArray) -> list[float | None]:
    return [float(f"{value:.5g}") if np.isfinite(value) else None for value in np.asarray(values).tolist()]
