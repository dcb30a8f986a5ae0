"""Options that say where the dynamics of a cut come from, gathered into one Source."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import wraps
from pathlib import Path
from typing import Any

import click

from toolpoint.app.naming import naming_options
from toolpoint.app.options import BAND, FILE, POSE, QUANTITY


@dataclass(frozen=True)
class Source:
    """Where the dynamics of a cut come from: a machine file at a pose, FRF files, an FRF for each direction, or saved modes.

    x, y : labels of the directions in the cutting plane where the data hold several; y may be ``same`` or ``rigid``;
    naming : what names of files and variables say, keywords of `frf_files.read`.
    """

    machine: Path | None = None
    pose: Mapping[str, float] | None = None
    frf: tuple[Path, ...] = ()
    modes: Path | None = None
    band: tuple[float, float] | None = None
    frf_x: Path | None = None
    frf_y: Path | None = None
    frf_xy: Path | None = None
    quantity: str | None = None
    x: str | None = None
    y: str | None = None
    naming: Mapping[str, Any] = field(default_factory=dict)


def dynamics_options(command: Any) -> Any:
    """Add the options of the dynamics; the command receives them as `source`."""
    @wraps(command)
    def gathered(**values: Any) -> Any:
        source = Source(**{part.name: values.pop(part.name) for part in fields(Source)})
        return command(source=source, **values)

    for option in reversed((
            click.argument("machine", required=False, type=FILE), POSE,
            click.option("--frf", multiple=True, type=FILE,
                         help="Measured tool-tip FRFs (universal, HDF5, MATLAB, NumPy, text); one response serves x and y "
                              "alike."),
            click.option("--frf-x", type=FILE, help="Measured FRF along x (the feed), one response; with --frf-y."),
            click.option("--frf-y", type=FILE, help="Measured FRF along y."),
            click.option("--frf-xy", type=FILE, help="Cross FRF of x and y, taken as symmetric; none where left out."),
            QUANTITY, BAND,
            click.option("--modes", type=FILE, help="Modes saved by identify (HDF5), or of a universal file."),
            click.option("--x", metavar="POINT:DIRECTION", help="Label of x where the data hold several points, e.g. 5:+x."),
            click.option("--y", metavar="POINT:DIRECTION", help="Label of y, or same (as along x), or rigid; that of x's "
                                                                "point where left out."))):
        gathered = option(gathered)
    return naming_options(gathered)
