"""`toolpoint update`: a machine file and measured modes or responses in, the machine that agrees with them out."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from toolpoint._check import ToolpointError, ToolpointWarning
from toolpoint.app import console
from toolpoint.app.measurements import Measurement, measurements
from toolpoint.app.poses import machine_at
from toolpoint.app.update_page import as_assumed, page
from toolpoint.io.yaml import machine_file as machine_yaml
from toolpoint.machine import Machine
from toolpoint.machine.description import parameters
from toolpoint.modal_identification import real_modes
from toolpoint.studies.machine_update import MachineUpdate, default_targets, update
from toolpoint.studies.model_correlation import correlate
from toolpoint.updating.sampler import Samples, require_emcee, sample
from toolpoint.vibration import Modes

Pose = Mapping[str, float]


@dataclass(frozen=True, eq=False)
class UpdateRun:
    """The update, and samples of its posterior where they were asked for."""

    update: MachineUpdate
    samples: Samples | None


def update_machine(
    machine: str | Path, modes: Sequence[str | Path] = (), frf: Sequence[str | Path] = (), paths: Sequence[str] = (),
    poses: Sequence[Pose] = (), machine_file: str | Path | None = None, output: str | Path = "toolpoint-report",
    quiet: bool = False, samples: int = 0, seed: int = 1,
) -> UpdateRun:
    """Update a machine to saved modes and measured FRFs, print the fit report, write the machine file and the page.

    Parameters that are not named are all stiffnesses of the joints; those that the data cannot tell stay where they were.
    Files and poses belong together as in `measurements`. `samples`: steps of every walker in the posterior, 0 for none.
    """
    if samples:
        require_emcee()
    with console.steps(4, quiet) as step, console.collected_warnings() as doubts:
        step("reading")
        built = machine_at(machine, *poses)
        measured = measurements(modes, frf, poses)
        _check_points(built, machine, measured, [*modes, *frf])
        measured = tuple(_with_partners(built, one) for one in measured)
        names = list(paths) or [p for p in parameters(built.description) if ".stiffness." in p]
        step("updating")
        targets = [default_targets(names, one.modes, one.frf) for one in measured]
        found = update(built, names, targets=targets, pose=[one.pose for one in measured])
        if machine_file is not None:
            machine_yaml.write(found.machine.description, machine_file)
        step("posterior" if samples else "page")
        drawn = _samples(found, samples, seed) if samples else None
        step("page")
        path = page(built, found, measured, drawn, doubts).save(output)
    if not quiet:
        console.OUT.print(found.report(), markup=False, soft_wrap=True)
        if drawn is not None:
            console.OUT.print("\n" + drawn.table(), markup=False, soft_wrap=True)
        for text in doubts:
            console.ERR.print("warning: " + text, markup=False, style="yellow")
        if machine_file is not None:
            console.OUT.print(f"Machine file written: {machine_file}", markup=False)
        console.OUT.print(f"Page written: {path}", markup=False)
    return UpdateRun(found, drawn)


def _check_points(built: Machine, file: str | Path, measured: Sequence[Measurement], files: Sequence[str | Path]) -> None:
    """Refuse measured points that the machine does not have, with the place where they can be written."""
    labels = [dof for one in measured for noun in (one.modes, one.frf) if noun is not None
              for dof in (noun.dofs if isinstance(noun, Modes) else (*noun.outputs, *noun.inputs))]
    known = set(built.description.points)
    lost = list(dict.fromkeys(str(dof.point) for dof in labels if str(dof.point) not in known))
    if lost:
        names = ", ".join(lost[:6]) + (f" and {len(lost) - 6} more" if len(lost) > 6 else "")
        raise ToolpointError(
            f"{', '.join(Path(one).name for one in files)}: measured at {names}; {Path(file).name} has no such points in its "
            f"section 'points:' (it has {', '.join(built.description.points) or 'none'}). Write them there, each with its "
            f"body and place, for example  {lost[0]}: {{body: {next(iter(built.description.bodies))}, at: [0, 0, 0]}}, or "
            "start from the machine file of 'toolpoint joints --machine', which holds all measured points; "
            "'toolpoint correlate --geometry' tells which measured point is which of the machine's")


def _with_partners(built: Machine, one: Measurement) -> Measurement:
    """Leave out, with a warning, the measured modes that a machine of fewer modes has no partner for."""
    if one.modes is None or one.modes.count <= built.size:
        return one
    pairs = correlate(built, real_modes(one.modes), pose=one.pose, lowest_mac=0.0, frequency_shift=np.inf).pairs
    kept = sorted(int(i) for i, _ in pairs.pairs)
    lost = ", ".join(f"{one.modes.frequency[i]:.5g}" for i in range(one.modes.count) if i not in kept)
    warnings.warn(f"{one.modes.count} measured modes for a machine of {built.size}: the measured modes at {lost} Hz look least "
                  "like any of the machine's and are left out", ToolpointWarning, stacklevel=2)
    return replace(one, modes=one.modes.selected(kept))


def _samples(found: MachineUpdate, steps: int, seed: int) -> Samples:
    if not found.fit.free:
        raise ToolpointError("--samples: no parameter was moved; a posterior needs at least one that the data can tell "
                             "(measure more, or name other parameters)")
    return sample(found.problem, as_assumed(found.fit), np.random.default_rng(seed), steps=steps)
