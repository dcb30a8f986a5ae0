"""PolePicker: a part of a page on which poles are added and modes removed, and that gives the command for it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass

from toolpoint.plot.page.frame import deflate_block

SCRIPT = "pole_picker.js"


@dataclass(frozen=True)
class PolePicker:
    """Poles to add and modes to remove, by a click on a chart's points or in the list; command and choice file are written.

    Parameters
    ----------
    chart : str
        Name of the Chart: a point of it with customdata (anything, damping in percent) adds a pole, one with
        ``("mode", k)`` removes mode k.
    modes : sequence of (frequency Hz, damping ratio)
    command : str
        The command that made the page, without a choice.
    added : sequence of (frequency Hz, damping ratio)
        Poles that were added already; `removed`: frequencies (Hz) of modes that are gone already.

    >>> picker = PolePicker("stabilisation", [(80.0, 0.02)], "toolpoint identify tip.uff", removed=[80.0])
    >>> "identify tip.uff" in picker.fragment()
    True
    """

    chart: str
    modes: Sequence[tuple[float, float]]
    command: str
    added: Sequence[tuple[float, float]] = ()
    removed: Sequence[float] = ()

    def fragment(self) -> str:
        """Return the place of the lists and the data block."""
        source = f"tp-picker-{self.chart}"
        data = {"chart": self.chart, "command": self.command, "removed": [_short(f) for f in self.removed],
                "modes": [{"f": _short(f), "z": _short(z)} for f, z in self.modes],
                "added": [{"f": _short(f), "z": _short(z)} for f, z in self.added]}
        return (f'<div class="tp-picker" data-source="{source}"><noscript>This list needs JavaScript.</noscript></div>'
                + deflate_block(source, json.dumps(data, separators=(",", ":"))))


def _short(value: float) -> float:
    return float(f"{value:.6g}")
