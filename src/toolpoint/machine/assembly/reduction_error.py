"""Error of a machine's frequencies at a pose by the reduction of elastic bodies: in words, and against richer bodies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TypeVar

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._doubt import Doubt
from toolpoint.machine.assembly.mesh_estimate import is_coarse, mesh_errors, mesh_words
from toolpoint.machine.assembly.reduction_estimate import ReductionEstimate, estimate_reduction
from toolpoint.machine.assembly.shapes import RIGID_FREQUENCY_FRACTION, body_shapes
from toolpoint.machine.description.elastic import ElasticDescription, SolidBody
from toolpoint.machine.parts.elastic_body import reliable_to
from toolpoint.machine.parts.model import Machine
from toolpoint.substructuring.reach import DEFAULT_REACH_RATIO, MIN_TRUSTED_REACH_RATIO

Described = TypeVar("Described", ElasticDescription, SolidBody)
REDUCTION_SUBJECT = "reduction of elastic bodies"
MAX_REDUCTION_ERROR = 0.01  # relative error from which a reduction is doubted
RICHER_BAND_RATIO = 1.5  # of the band, in the richer bodies; they keep all responses


def has_described_elastic_bodies(machine: Machine) -> bool:
    """Return whether a body of the machine is elastic by its description."""
    return any(body.elastic is not None or body.solid is not None for body in machine.description.bodies.values())


def reduction_error(machine: Machine, pose: Mapping[str, float] | None = None, modes: int = 10) -> FloatArray | None:
    """Return the relative rise of the lowest frequencies at a pose by reduction, (modes,); None without
    described elastic bodies.

    The machine is built again with bodies of `RICHER_BAND_RATIO` times the band, stations half as far apart, and all responses
    to loads with what their inertia does, whose own error is of a higher order: a comparison, not a bound (a bound of one body
    in known surroundings: `couple_reduced`).
    """
    if not has_described_elastic_bodies(machine):
        return None
    bodies = {name: replace(body, **{kind: _enriched(part) for kind in ("elastic", "solid")
                                     if (part := getattr(body, kind)) is not None})
              for name, body in machine.description.bodies.items()}
    richer = machine.rebuild(replace(machine.description, bodies=bodies))
    frequency, richer_frequency = (body_shapes(variant, dict(pose or {}), modes).frequency for variant in (machine, richer))
    count = min(len(frequency), len(richer_frequency))
    # What nothing holds is at 0 Hz in both
    is_held = richer_frequency[:count] > RIGID_FREQUENCY_FRACTION * richer_frequency[:count].max(initial=0.0)
    return np.where(is_held, frequency[:count] / np.where(is_held, richer_frequency[:count], 1.0) - 1, 0.0)


def doubt_modes_above_bands(machine: Machine, frequency: FloatArray) -> tuple[Doubt, ...]:
    """Return a doubt about natural frequencies (Hz) above what a body of elements or matrices was reduced for."""
    sure_bands = {name: float(kind.band) if kind is body.beam else kind.band * DEFAULT_REACH_RATIO / MIN_TRUSTED_REACH_RATIO
                  for name, body in machine.description.bodies.items()
                  for kind in (body.elastic, body.solid, body.beam, body.matrices) if kind is not None}
    if not sure_bands:
        return ()
    name = min(sure_bands, key=lambda body: sure_bands[body])
    believed_count = int((frequency <= sure_bands[name]).sum())
    if believed_count >= len(frequency):
        return ()
    modes_text = (f"modes {believed_count + 1} to {len(frequency)}" if believed_count + 1 < len(frequency) else
                  f"mode {believed_count + 1}")
    return (Doubt(modes_text,
                  f"above {sure_bands[name]:.4g} Hz, beyond which frequencies are too high and modes may be missing: body "
                  f"{name} was reduced for a lower band", f"write a larger band for {name}, or leave these modes"),)


def _enriched(elastic: Described) -> Described:
    """Return a description with a wider band and closer stations, whose own error is of a higher order."""
    places = {name: replace(part, stations=(part.stations or part.length / 2) / 2) if part.slide and part.length else part
              for name, part in elastic.interfaces.items()}
    return replace(elastic, band=RICHER_BAND_RATIO * elastic.band, size=None, interfaces=places)


def reduction_note(machine: Machine, pose: Mapping[str, float] | None = None, modes: int = 10) -> str:
    """Return the effect of the reduction at a pose in words, a `Doubt` where it matters; nothing without elastic bodies.

    By `estimate_reduction`; where a body's parts were scaled apart since it was reduced, by comparison with richer bodies.
    """
    estimate = estimate_reduction(machine, pose, modes)
    return _comparison_note(machine, pose, modes) if estimate is None else estimate_note(estimate)


def estimate_note(estimate: ReductionEstimate) -> str:
    """Return an estimate in words: the rise of the modes; a `Doubt` where some are not to be believed, with the reasons."""
    error, is_sure, count = estimate.error, estimate.is_sure, len(estimate.error)
    beyond_count = int((estimate.frequency > estimate.sure_to).sum())
    coarse_modes = np.flatnonzero(~is_sure[:count - beyond_count])
    reasons, remedies, largest = ["no mode's estimate can be believed"], list[str](), float("nan")
    if is_sure.any():
        worst_mode = int(np.where(is_sure, error, -1.0).argmax())
        largest = float(error[worst_mode])
        modes_text = f"the first {count} frequencies" if is_sure.all() else f"{is_sure.sum()} of {count} frequencies"
        reasons = [f"{modes_text} are within {_percent(largest)} of those with all finite elements (mode {worst_mode + 1}; an "
                   "estimate from the forces that each mode leaves in them)"]
    reasons.append(mesh_words(estimate.mesh))
    if coarse_modes.size:
        reasons.append(f"estimate of mode {coarse_modes[0] + 1} too large to believe, {_percent(error[coarse_modes[0]])}")
        remedies.append("give the body a larger size")
    if beyond_count and estimate.sure_to:
        reasons.append(f"{beyond_count} of {count} modes above {estimate.sure_to:.4g} Hz, where free modes of a body may be "
                       "missing")
        remedies.append("give it a larger band")
    elif beyond_count:
        reasons.append("which free modes the bodies keep is not known")
        remedies.append("compare with a body of a larger band")
    if largest > MAX_REDUCTION_ERROR and not remedies:
        remedies.append("give the bodies a larger size or band")
    if estimate.mesh is not None and is_coarse(estimate.mesh):
        remedies.append("take a smaller mesh_size")
        largest = max(float(estimate.mesh.max()), np.nan_to_num(largest))
    words = "; ".join(reasons)
    return Doubt(REDUCTION_SUBJECT, words, " and ".join(remedies),
                 figure=largest) if remedies else f"{REDUCTION_SUBJECT}: {words}"


def _percent(fraction: float) -> str:
    return f"{100 * max(float(fraction), 1e-10):.2g} %" if np.isfinite(fraction) else "no bound"


def _comparison_note(machine: Machine, pose: Mapping[str, float] | None, modes: int) -> str:
    error = reduction_error(machine, pose, modes)
    if error is None:
        return ""
    worst_mode = int(abs(error).argmax())
    percent = 100 * abs(error[worst_mode])
    shapes = body_shapes(machine, dict(pose or {}), len(error))
    mesh = mesh_errors(machine, 2 * np.pi * shapes.frequency, shapes.vectors)
    words = (f"the first {len(error)} frequencies are within {percent:.2g} % of richer bodies' of the same mesh (mode "
             f"{worst_mode + 1}), a comparison and no bound; {mesh_words(mesh)}")
    parts = [body.elastic or body.solid for body in machine.description.bodies.values()]
    sure_frequency = min((reliable_to(part) for part in parts if part is not None), default=0.0)
    if mesh is not None and is_coarse(mesh):
        return Doubt(REDUCTION_SUBJECT, words, "take a smaller mesh_size", figure=float(mesh.max()))
    if abs(error[worst_mode]) > MAX_REDUCTION_ERROR or float(shapes.frequency[-1]) > sure_frequency:
        return Doubt(REDUCTION_SUBJECT,
                     f"{words}; modes above {sure_frequency:.4g} Hz and a size that is too small are the usual reasons",
                     "give the bodies a larger band or size", figure=percent / 100)
    return f"{REDUCTION_SUBJECT}: {words}"
