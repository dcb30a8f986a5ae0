"""The published machine as a test sees it: 131 points, components, masses, hammer records at a stated noise.

Published: positions, freedoms and stiffnesses of the joints (Machines 2022, 10(11), 1102). Chosen: masses, points, noise.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from importlib import resources

import numpy as np

from toolpoint.io.yaml import machine_file
from toolpoint.joint_identification import ComponentMass
from toolpoint.machine.parts.model import Machine
from toolpoint.modal_identification import identify, real_modes
from toolpoint.signals.hammer import hammer_test
from toolpoint.signals.setups import join_setups
from toolpoint.spatial import transform as tf
from toolpoint.studies.machines.virtual_test import Imperfections, hammer_records, surface_points, true_modes
from toolpoint.vibration import Dof, Frf, Modes, frequency_response

CHAIN = ("ground", "base", "column", "magazine")
RIDES_ON = {"base": "base", "saddle": "base", "table": "base", "column": "column", "head": "column", "magazine": "magazine"}
KINDS = {"base": "spherical", "column": "hinge", "magazine": "universal"}
FREEDOMS = {"base": ("rx", "ry", "rz"), "column": ("rx",), "magazine": ("ry", "rz")}
AT = {"base": (0.0, 1.063, -1.5), "column": (0.0, 1.3, 0.1), "magazine": (-0.28, 1.5, 1.35)}
STIFFNESS = {"base": (902.78e6, 653.58e6, 147.12e6), "column": (184.64e6,), "magazine": (2.68e6, 5.56e6)}


@dataclass(frozen=True, eq=False)
class Case:
    """Positions, points of every component, true modes, masses."""

    points: dict
    components: dict
    truth: Modes
    masses: dict


def machine() -> Machine:
    """Return the machine of six freedoms."""
    with resources.as_file(resources.files("toolpoint.app") / "machines" / "three_axis_vertical.yaml") as path:
        return machine_file.read(path)


def case(model: Machine, rng: np.random.Generator, number: int = 131) -> Case:
    """Return a case with points drawn on the surfaces."""
    points = surface_points(model, number, rng)
    components: dict = {}
    for body, names in points.components.items():
        components.setdefault(RIDES_ON[body], []).extend(names)
    return Case(points.coordinates, components, true_modes(model, points, 0.03), masses(model))


def masses(model: Machine) -> dict:
    """Return the mass properties of the three components, boxes uniform."""
    parts: dict = {}
    for name, body in model.description.bodies.items():
        centre = tf.move(model.body_frames[model.link(name)], np.array(body.centre)[None])[0]
        if body.inertia is not None:
            inertia = body.inertia.tensor
        else:
            square = np.array(body.shape.size) ** 2
            inertia = body.mass / 12 * np.diag(square.sum() - square)
        parts.setdefault(RIDES_ON[name], []).append(ComponentMass(body.mass, centre, inertia))
    return {name: ComponentMass.joined(one) for name, one in parts.items()}


def noisy(truth: Modes, share: float, rng: np.random.Generator, known: bool = True) -> Modes:
    """Return the modes with independent noise of `share` of every mode's rms on all entries."""
    spread = np.broadcast_to(share * np.sqrt((truth.shape**2).mean(axis=0)), truth.shape.shape)
    return replace(truth, shape=truth.shape + spread * rng.normal(size=spread.shape),
                   shape_variance=spread**2 if known else None)


def striking_point(modes: Modes) -> Dof:
    """Return the Dof at which the weakest mode is still seen best."""
    share = np.abs(modes.shape) / np.abs(modes.shape).max(axis=0)
    return modes.dofs[int(np.argmax(share.min(axis=1)))]


def identified(frf: Frf) -> Modes:
    """Return real, mass-normalised modes found in frequency responses."""
    return real_modes(identify(frf, band=(5, 150)).modes)


def from_responses(truth: Modes, share: float, rng: np.random.Generator) -> Modes:
    """Return modes identified from accelerances to 150 Hz with noise of `share` of every FRF's rms, as the issue asks."""
    lines = np.arange(5.0, 150.01, 0.25)
    frf = frequency_response.modal(truth, lines, truth.dofs, inputs=[striking_point(truth)], quantity="accelerance")
    size = share * np.sqrt((np.abs(frf.values) ** 2).mean(axis=0))
    noise = rng.normal(size=frf.values.shape) + 1j * rng.normal(size=frf.values.shape)
    return identified(replace(frf, values=frf.values + size * noise / np.sqrt(2)))


def from_blows(truth: Modes, share: float, rng: np.random.Generator) -> Modes:
    """Return modes identified from hammer records, one point at a time, with noise of `share` of every channel's rms."""
    struck = striking_point(truth)
    parts = []
    for point in dict.fromkeys(dof.point for dof in truth.dofs):
        labels = [Dof(point, way) for way in ("+x", "+y", "+z")]
        record = hammer_records(truth, struck, labels, rng=rng, hammer=None, imperfections=Imperfections(noise=share))
        parts.append(hammer_test(record, 4.0, highest=150).frf)
    return identified(join_setups(parts))
