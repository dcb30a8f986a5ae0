"""One shot for the shop floor: tap."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from toolpoint import io, pages, studies
from toolpoint.app.cut_options import CutValues
from toolpoint.app.declare import Help, command
from toolpoint.app.frame import Frame
from toolpoint.app.options import Files, Quantity
from toolpoint.app.values import SourceFile, SpindleSpeeds


@dataclass(frozen=True)
class TapLabels:
    """What records or responses of the tip measured, and where."""

    channel: Annotated[tuple[str, ...], Help("What a channel of the records measures, where, its sensitivity; several times.",
                                             metavar="'1=force tip:+x 2.25mV/N'")] = ()
    name: Annotated[str | None, Help("Where names of files say points: Point_{input}_*.", metavar="PATTERN")] = None
    struck: Annotated[str | None, Help("Where was struck (or measured), where the names do not say it.",
                                       metavar="POINT:DIRECTION")] = None
    quantity: Quantity = None

    def read(self, files: Sequence[Path], progress: Any) -> Any:
        """Return the hammer study of records, or the responses that files hold."""
        progress("reading", 0, 1)
        if io.hold_records(files):
            records = io.read_records(files, self.channel, struck=self.struck, pattern=self.name)
            return studies.study_hammer_records(records)
        return io.read_frf(files, quantity=self.quantity, pattern=self.name, struck=self.struck)


@command()
def tap(run: Frame, files: Files, *,
        across: Annotated[tuple[SourceFile, ...], Help("Records or responses along y; several times. As x where left out.",
                                                       name="--y")] = (),
        tip: Annotated[str | None, Help("The tip along x where the files hold several driving points.",
                                        metavar="POINT:DIRECTION")] = None,
        labels: TapLabels, cut: CutValues,
        speeds: Annotated[SpindleSpeeds | None, Help("Spindle speeds that the machine has, rev/min.",
                                                     metavar="3000:20000:200")] = None) -> None:
    """From hammer blows on a tool's tip to spindle speeds to use, with a light for each step.

    FILES are the records of blows along x, the feed (any format of `toolpoint frf`), or responses of the tip (any format of
    `toolpoint identify`); --y those along y. Give the cutter (--diameter, --teeth ...) and the material (--material, or --kt
    and --kn).
    """
    progress = run.progress_of_parts()
    x, y = labels.read(files, progress), labels.read(across, progress) if across else None
    ends = None if speeds is None else (float(speeds[0]), float(speeds[-1]))
    result = studies.study_tap(x, y, cut, tip=tip, speeds=ends, rng=np.random.default_rng(0), progress=progress)
    run.save(pages.tap_page, result, run.warnings)
    run.show(result, result.limits.notes)
