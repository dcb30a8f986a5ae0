"""The response between tool and work that a cut meets: read, brought to common lines, and its directions chosen."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from toolpoint._check import ToolpointError, ToolpointWarning
from toolpoint.app.geometry import UNIVERSAL
from toolpoint.app.identify import read_frf
from toolpoint.app.poses import machine_at
from toolpoint.app.source import Source
from toolpoint.io import hdf5, uff
from toolpoint.machine import Machine
from toolpoint.modal_identification import identify
from toolpoint.studies.tool_point import tool_point
from toolpoint.vibration import Dof, Frf, Modes

HDF5 = (".h5", ".hdf5")
LOW_PART = 0.02
LEAST_FIT = 0.9
ACTIVE = 0.25  # share of the imaginary part (squares) above zero that no driving point has
OWN = (*UNIVERSAL, *HDF5, ".mat")


@dataclass(frozen=True, eq=False)
class Dynamics:
    """Modes or lines of one pose with the labels of the cutting plane; y is ``same`` or None (rigid) where not known.

    machine : the machine that they are of, where there is one; notes : which file gave what, and what was assumed.
    """

    response: Modes | Frf
    x: str
    y: str | None
    machine: Machine | None = None
    notes: tuple[str, ...] = ()


def dynamics_of(source: Source) -> Dynamics:
    """Return the dynamics of a source; raises ToolpointError where none or several are named, or files do not fit."""
    _check(source)
    if source.machine is not None:
        _not_a_machine(source.machine)
        machine = machine_at(source.machine, source.pose)
        study = tool_point(machine, [dict(source.pose)] if source.pose else [{}])
        x, y = (f"{study.point}:+{way}" for way in "xy")
        return Dynamics(study.modes.at_pose(0), source.x or x, y if source.y is None else _rest(source.y), machine)
    if source.modes is not None:
        modes = _modes(source.modes)
        x, ways, notes = directions(modes.dofs, source.x, source.y, str(source.modes))
        return Dynamics(modes, x, ways, None, notes)
    if source.frf_x is not None:
        return _of_pair(source)
    return _of_files(source)


def _check(source: Source) -> None:
    named = {"a machine file": source.machine, "--frf": source.frf, "--frf-x": source.frf_x or source.frf_y or source.frf_xy,
             "--modes": source.modes}
    given = [name for name, value in named.items() if value]
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
    for name, value in (("--band", source.band), ("--quantity", source.quantity)):
        if value is not None and (source.machine or source.modes):
            raise ToolpointError(f"{name}: is for measured FRFs; {given[0]} has none")
    for name, value in (("--x", source.x), ("--y", source.y)):
        if value is not None and (source.machine or source.frf_x):
            where = "its tool point" if source.machine else "--frf-x and --frf-y"
            if not (name == "--y" and value in ("same", "rigid")):
                raise ToolpointError(f"{name}: is for FRFs and modes of several points; {given[0]} tells by {where}")


def _not_a_machine(path: Path) -> None:
    kind = path.suffix.lower()
    if kind in (*OWN, ".txt", ".csv", ".frf", ".dat"):
        raise ToolpointError(f"{path}: a machine is a YAML file; measured FRFs are given with --frf, saved modes with --modes")


def _rest(y: str | None) -> str | None:
    return None if y == "rigid" else y


def _modes(path: Path) -> Modes:
    if path.suffix.lower() in UNIVERSAL:
        return uff.read_modes(path)
    if path.is_file() and path.suffix.lower() not in HDF5:
        raise ToolpointError(f"{path}: saved modes are HDF5 files (.h5, from toolpoint identify -m) or universal files; "
                             "measured FRFs are given with --frf")
    found: Modes = _noun(path, Modes, "give it with --frf, or identify its modes first: toolpoint identify")
    return found


def _noun(path: Path, kind: type, remedy: str) -> Any:
    found = hdf5.read(path)
    several = found if isinstance(found, dict) else {"": found}
    fitting = [one for one in several.values() if isinstance(one, kind)]
    if len(fitting) != 1:
        held = ", ".join(type(one).__name__ for one in several.values())
        raise ToolpointError(f"{path}: holds {held}; needs one {kind.__name__}" + ("" if fitting else f" ({remedy})"))
    return fitting[0]


def responses(files: Sequence[Path], quantity: str | None = None) -> Frf:
    """Return FRF files as one Frf with all directions along positive axes."""
    files = [Path(file) for file in files]
    if len(files) == 1 and files[0].suffix.lower() in HDF5:
        frf: Frf = _noun(files[0], Frf, "give it with --modes")
        if quantity not in (None, frf.quantity):
            raise ToolpointError(f"--quantity {quantity}: {files[0].name} says that it holds {frf.quantity}; leave it out")
    else:
        frf = read_frf(files, quantity)
    if frf.values.ndim > 3:
        raise ToolpointError(f"{files[0]}: responses of {frf.values.shape[0]} poses; must be one pose")
    return _positive(frf)


def banded(frf: Frf, band: tuple[float, float] | None) -> Frf:
    """Return measured responses as receptance, cut to a band (Hz).

    Without a band the lowest part of the lines is left out, as receptances integrated from accelerations grow without
    limit there; a note says so.
    """
    if band is not None:
        inside = (frf.frequency >= band[0]) & (frf.frequency <= band[1])
        if inside.sum() < 2:
            raise ToolpointError(f"--band {band[0]:g}:{band[1]:g}: holds {int(inside.sum())} lines; the measurement goes from "
                                 f"{frf.frequency[0]:g} to {frf.frequency[-1]:g} Hz")
        if frf.quantity != "receptance" and band[0] == 0:
            inside &= frf.frequency > 0  # a line at 0 Hz cannot be integrated
        lines = frf.frequency[inside]
        return frf.between(float(lines[0]), float(lines[-1])).converted_to("receptance")
    low = LOW_PART * float(frf.frequency[-1])
    note = (f"Lines below {low:g} Hz ({100 * LOW_PART:g} % of the range) are left out: integrated accelerations drift there. "
            "Choose another band with --band.")
    return frf.between(low, float(frf.frequency[-1])).converted_to("receptance").noted(note)


def _positive(frf: Frf) -> Frf:
    """Turn responses and forces along negative axes round: a hammer from the other side gives the opposite sign."""
    def turned(labels: tuple[Dof, ...]) -> tuple[list[Dof], list[int]]:
        new = [Dof(d.point, "+" + d.direction[1:]) if d.vector is None else d for d in labels]
        if len(set(new)) < len(new):  # both senses were measured: each keeps its label
            return list(labels), [1] * len(labels)
        return new, [1 if d.vector is not None or d.direction[0] == "+" else -1 for d in labels]

    (rows, signs), (columns, turns) = turned(frf.outputs), turned(frf.inputs)
    return replace(frf, values=frf.values * np.outer(signs, turns), outputs=tuple(rows), inputs=tuple(columns))


def _of_files(source: Source) -> Dynamics:
    plain = [file for file in source.frf if file.suffix.lower() not in OWN and not {"=", "__"} & _marks(file.stem)]
    if len(source.frf) > 1 and plain:
        raise ToolpointError(f"--frf: {len(source.frf)} files, and {plain[0].name} does not say its direction; give one for "
                             "both directions, or --frf-x FILE --frf-y FILE, or name text files like tip=+x__tip=+y.txt "
                             "(response at tip in x, force at tip in y)")
    frf = responses(source.frf, source.quantity)
    struck = [dof for dof in frf.outputs if dof in frf.inputs]
    if not struck:
        raise ToolpointError(f"{source.frf[0]}: no driving point: responses at {_some(frf.outputs)}, forces at "
                             f"{_some(frf.inputs)}; the cut needs the response where the force acts")
    files = ", ".join(file.name for file in source.frf)
    x, y, notes = directions(struck, source.x, source.y, files)
    frf = banded(frf, source.band)
    wanted = list(dict.fromkeys([x] + ([y] if y not in (None, "same") else []) + _axial(struck, x)))
    frf = frf.selected(wanted, wanted)
    _doubt_sign(frf, files)
    told = f"{files}, {frf.quantity if source.quantity is None else source.quantity}: response along x is {x}"
    return Dynamics(frf, x, y, None, (_read_as(source.frf, source.quantity, told + _second(y)), *notes, *frf.notes))


def _read_as(files: Sequence[Path], quantity: str | None, told: str) -> str:
    kinds = {file.suffix.lower() for file in files} - {*UNIVERSAL, *HDF5}
    return told + (" (read as such; --quantity for another)" if kinds and quantity is None else "")


def _second(y: str | None) -> str:
    return "" if y in (None, "same") else f", along y {y}"


def _marks(stem: str) -> set[str]:
    return {mark for mark in ("=", "__") if mark in stem}


def _axial(labels: Sequence[Dof], x: str) -> list[str]:
    along = Dof(Dof.parse(x).point, "+z")
    return [str(along)] if along in labels and x != str(along) else []


def _some(labels: Sequence[Dof]) -> str:
    return ", ".join(map(str, labels[:4])) + (" ..." if len(labels) > 4 else "")


def directions(labels: Sequence[Dof], x: str | None, y: str | None, what: str) -> tuple[str, str | None, tuple[str, ...]]:
    """Return the labels of x and y among those that are known, and what was assumed.

    y is ``same`` where only x is known; raises ToolpointError where several points could be meant or a label is not there.
    """
    plain = [dof for dof in labels if dof.vector is None and not dof.is_rotation]
    if x is None:
        if not plain:
            raise ToolpointError(f"{what}: no point with both response and force, which the cut needs")
        along = [dof for dof in plain if dof.direction[1:] == "x"] or plain
        if len(along) != 1:
            raise ToolpointError(f"{what}: which point cuts? It holds {_some(labels)}; name x with --x, for example --x "
                                 f"{along[0]}")
        chosen = along[0]
    else:
        chosen = _known(x, labels, "--x", what)
    if y == "rigid":
        return str(chosen), None, ("the tool is taken as rigid along y",)
    if y not in (None, "same"):
        return str(chosen), str(_known(str(y), labels, "--y", what)), ()
    beside = [dof for dof in plain if dof.point == chosen.point and dof.direction[1:] == "y" and chosen.direction[1:] == "x"]
    if y is None and len(beside) == 1:
        return str(chosen), str(beside[0]), ()
    return str(chosen), "same", (f"the response across is taken as that along ({chosen}); --y rigid takes none",)


def _known(label: str, labels: Iterable[Dof], option: str, what: str) -> Dof:
    wanted = Dof.parse(label)
    if wanted not in labels:
        raise ToolpointError(f"{option} {label}: not in {what}; it holds {_some(list(labels))}")
    return wanted


def _of_pair(source: Source) -> Dynamics:
    """Return the 2x2 receptance of separate files; y and cross are brought to the lines of x."""
    files = {"x": source.frf_x, "y": source.frf_y, "xy": source.frf_xy}
    parts: dict[str, Frf] = {}
    notes: list[str] = []
    for way, file in files.items():
        if file is None:
            continue
        frf = responses([file], source.quantity)
        if frf.values.shape[1:] != (1, 1):
            raise ToolpointError(f"--frf-{way}: {file.name} holds {len(frf.outputs)} x {len(frf.inputs)} responses; must be "
                                 "one; a file with several is given with --frf, --x and --y")
        words = {"x": "along x", "y": "along y", "xy": "across (x to y and y to x)"}[way]
        notes.append(_read_as([file], source.quantity, f"{words}: {file.name}, {frf.quantity}"))
        parts[way] = banded(frf, source.band)
        if way != "xy":
            _doubt_sign(parts[way], file.name)
    if source.frf_y is None:
        return _one_direction(parts["x"], source, notes)
    parts = _on_common_lines(parts, notes)
    x, y = parts["x"].values[:, 0, 0], parts["y"].values[:, 0, 0]
    cross = parts["xy"].values[:, 0, 0] if "xy" in parts else np.zeros_like(x)
    notes += [] if "xy" in parts else ["no cross response between x and y"]
    values = np.stack([np.stack([x, cross], -1), np.stack([cross, y], -1)], -2)
    labels = (Dof("tool", "+x"), Dof("tool", "+y"))
    notes += [note for part in parts.values() for note in part.notes]
    frf = Frf(parts["x"].frequency, values, labels, labels, "receptance")
    return Dynamics(frf, "tool:+x", "tool:+y", None, tuple(dict.fromkeys(notes)))


def _one_direction(frf: Frf, source: Source, notes: list[str]) -> Dynamics:
    label = (Dof("tool", "+x"),)
    y = "same" if source.y is None else _rest(source.y)
    told = "the response across is taken as that along x" if y == "same" else "the tool is taken as rigid along y"
    return Dynamics(replace(frf, outputs=label, inputs=label), "tool:+x", y, None, (*notes, told, *frf.notes))


def _on_common_lines(parts: dict[str, Frf], notes: list[str]) -> dict[str, Frf]:
    first = parts["x"].frequency
    if all(part.frequency.shape == first.shape and np.allclose(part.frequency, first, rtol=1e-9) for part in parts.values()):
        return parts
    low, high = (max(p.frequency[0] for p in parts.values()), min(p.frequency[-1] for p in parts.values()))
    lines = first[(first >= low) & (first <= high)]
    if lines.size < 2:
        spans = "; ".join(f"{way}: {p.frequency[0]:g} .. {p.frequency[-1]:g} Hz" for way, p in parts.items())
        raise ToolpointError(f"--frf-x, --frf-y: no common lines ({spans}); measure both over one band")
    notes.append(f"the files have other lines: taken at those of x within {low:g} .. {high:g} Hz, linearly between their own")
    return {way: part.interpolated(lines) for way, part in parts.items()}


def _doubt_sign(frf: Frf, name: str) -> None:
    """Warn of a driving point whose imaginary part is positive where it is large: no passive structure has it.

    Its real part, read as the imaginary one (columns changed over, a mobility), is positive below every resonance.
    """
    for i, dof in enumerate(frf.outputs):
        own = frf.values[:, i, frf.inputs.index(dof)] if dof in frf.inputs else frf.values[:, 0, 0]
        peak = own[int(np.argmax(np.abs(own)))]
        positive = float((np.maximum(own.imag, 0.0) ** 2).sum() / max(float((own.imag**2).sum()), 1e-300))
        if peak.imag > 0.5 * abs(peak) or positive > ACTIVE:
            where = "at the largest peak" if peak.imag > 0.5 * abs(peak) else "over wide parts of the band"
            warnings.warn(f"{name}: the imaginary part along {dof} is positive {where}; at a driving point it is negative "
                          "(check the sense of hammer and sensor, the sign, the order of the columns, and --quantity)",
                          ToolpointWarning, stacklevel=3)


def identified(frf: Frf, source: Source) -> tuple[Modes, list[str]]:
    """Return the modes of measured lines, for what steps through time, and what they are worth.

    Raises ToolpointError where they do not explain the lines.
    """
    several = len(frf.outputs) == 2 and not np.abs(frf.values[:, 0, 1]).max()
    found = [identify(frf.selected([k], [k])) for k in (0, 1)] if several else [identify(frf)]
    worst = min(float(one.quality.min()) for one in found)
    files = ", ".join(file.name for file in (*source.frf, source.frf_x, source.frf_y, source.frf_xy) if file is not None)
    if worst < LEAST_FIT:
        raise ToolpointError(f"{files}: a simulation in time needs modes, and those found here explain only {100 * worst:.0f} "
                             "% of a response; identify them with care: toolpoint identify FILE -m modes.h5 --band LOW:HIGH, "
                             "then give --modes modes.h5")
    modes = _side_by_side(found[0].modes, found[1].modes) if several else found[0].modes
    told = ", ".join(f"{f:.0f}" for f in modes.frequency[:8]) + (" ..." if modes.count > 8 else "")
    return modes, [f"a simulation in time needs modes: {modes.count} identified from {files} ({told} Hz); they explain "
                   f"{100 * worst:.1f} % of every response, or more"]


def _side_by_side(x: Modes, y: Modes) -> Modes:
    """Return the modes of two directions that do not answer each other as one."""
    def blocks(a: Any, b: Any) -> Any:
        return None if a is None or b is None else np.block([[a, np.zeros((1, b.shape[1]))], [np.zeros((1, a.shape[1])), b]])

    labels = (*x.dofs, *y.dofs)
    return Modes(np.append(x.frequency, y.frequency), np.append(x.damping_ratio, y.damping_ratio), blocks(x.shape, y.shape),
                 labels, "modal A" if x.scaling == y.scaling == "modal A" else "unscaled",
                 participation=blocks(x.participation, y.participation), input_dofs=labels,
                 lower_residual=blocks(x.lower_residual, y.lower_residual),
                 upper_residual=blocks(x.upper_residual, y.upper_residual))
