"""Reading what the options of the dynamics name: a machine file at a pose, measured responses, or saved modes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from toolpoint._check import ToolpointError
from toolpoint.app.source import Source
from toolpoint.io.suffixes import HDF5, MATLAB, NUMPY, TEXT, UNIVERSAL

if TYPE_CHECKING:
    from toolpoint.studies.cuts.tool_dynamics import ToolDynamics
    from toolpoint.vibration import Frf, Modes


def read_dynamics(source: Source) -> ToolDynamics:
    """Read the dynamics; raises ToolpointError where none or several are named, or files do not fit."""
    _check(source)
    for read in (_of_machine, _of_modes, _of_directions):
        if (dynamics := read(source)) is not None:
            return dynamics
    measured = read_responses(source.frf, source.quantity, source.naming)

    from toolpoint.studies.cuts.tool_dynamics import response_dynamics

    return response_dynamics(measured, source.x, source.y, band=source.band, what=", ".join(file.name for file in source.frf))


def _of_machine(source: Source) -> ToolDynamics | None:
    if source.machine is None:
        return None
    _refuse_measurement(source.machine)

    from toolpoint.app.poses import machine_at

    machine = machine_at(source.machine, source.pose)

    from toolpoint.studies.cuts.tool_dynamics import machine_dynamics

    return machine_dynamics(machine, source.pose, source.y)


def _of_modes(source: Source) -> ToolDynamics | None:
    if source.modes is None:
        return None
    modes = _read_modes(source.modes)

    from toolpoint.studies.cuts.tool_dynamics import modal_dynamics

    return modal_dynamics(modes, source.x, source.y, what=str(source.modes))


def _of_directions(source: Source) -> ToolDynamics | None:
    if source.frf_x is None:
        return None
    paths = {"x": source.frf_x, "y": source.frf_y, "xy": source.frf_xy}
    parts = {way: read_responses([path], source.quantity, source.naming) for way, path in paths.items() if path is not None}

    from toolpoint.studies.cuts.tool_dynamics import separate_dynamics

    return separate_dynamics(**parts, across=source.y, band=source.band,
                             names={way: path.name for way, path in paths.items() if path is not None})


def _check(source: Source) -> None:
    options = {"a machine file": source.machine, "--frf": source.frf,
               "--frf-x": source.frf_x or source.frf_y or source.frf_xy, "--modes": source.modes}
    given = [name for name, value in options.items() if value]
    if not given:
        raise ToolpointError("dynamics: none given; name a machine file, or give --frf, --frf-x and --frf-y, or --modes")
    if len(given) > 1:
        raise ToolpointError(f"dynamics: {' and '.join(given)} given; must be one of them")
    if source.frf_x is None and given == ["--frf-x"]:
        raise ToolpointError("--frf-y, --frf-xy: given without --frf-x; give the FRF along x too (for one direction: --frf)")
    if source.frf_xy is not None and source.frf_y is None:
        raise ToolpointError("--frf-xy: given without --frf-y; the cross FRF needs both directions")
    if source.pose and source.machine is None:
        raise ToolpointError("--pose: needs a machine file to be applied to")
    named = source.naming and "--name, --struck, --variables"
    for name, value in (("--band", source.band), ("--quantity", source.quantity), (named or "", source.naming or None)):
        if value is not None and (source.machine or source.modes):
            raise ToolpointError(f"{name}: is for measured FRFs; {given[0]} has none")
    for name, label in (("--x", source.x), ("--y", source.y)):
        if label is not None and (source.machine or source.frf_x) and not (name == "--y" and label in ("same", "rigid")):
            where = "its tool point" if source.machine else "--frf-x and --frf-y"
            raise ToolpointError(f"{name}: is for FRFs and modes of several points; {given[0]} tells by {where}")


def _refuse_measurement(path: Path) -> None:
    if path.suffix.lower() in (*UNIVERSAL, *HDF5, *MATLAB, *NUMPY, *TEXT):
        raise ToolpointError(f"{path}: a machine is a YAML file; measured FRFs are given with --frf, saved modes with --modes")


def _read_modes(path: Path) -> Modes:
    from toolpoint.io.measured import mode_files

    try:
        return mode_files.read(path)
    except ToolpointError as error:
        remedy = "give it with --frf, or identify its modes first: toolpoint identify"
        raise ToolpointError(f"{error} ({remedy})" if "needs one Modes" in str(error) else str(error)) from None


def read_responses(paths: Sequence[Path], quantity: str | None, naming: Mapping[str, Any] | None = None) -> Frf:
    """Return the responses that files hold; `naming` : what their names and variables say, keywords of `frf_files.read`."""
    from toolpoint.io.measured import frf_files

    try:
        return frf_files.read(paths, quantity=quantity, **(naming or {}))
    except ToolpointError as error:
        remedy = (" (give it with --modes)" if "needs one Frf" in str(error) else
                  "; the directions apart are given with --frf-x FILE --frf-y FILE" if "its direction" in str(error) else "")
        raise ToolpointError(f"{error}{remedy}") from None
