"""Virtual test rig: any machine struck by a virtual hammer, with the imperfections of a real test and a known truth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike
from scipy.signal import fftconvolve, firwin

from toolpoint._check import FloatArray, count, fail, floats, positive
from toolpoint.kinematics import Pose
from toolpoint.machine.assembly.shapes import body_shapes
from toolpoint.machine.description import GROUND, BodyDescription
from toolpoint.machine.parts.mass import equivalent_cuboid
from toolpoint.machine.parts.model import Machine
from toolpoint.spatial import transform as tf
from toolpoint.vibration import Dof, Modes, Record, StateSpace
from toolpoint.vibration.dof import dofs
from toolpoint.vibration.simulation import time_response

_FORCE_OVERSAMPLING = 6  # steps of the force in a sample of the record
MIN_BODY_POINTS = 6  # candidates a body, where all bodies together have so many
_DIRECTIONS = ("+x", "+y", "+z")


@dataclass(frozen=True)
class Imperfections:
    """Imperfections of a test.

    Parameters
    ----------
    noise : float
        Standard deviation of the noise on every channel, as share of the channel's rms over the record.
    double_hits, weak_hits : sequences of int
        Hits (from 0) that bounce, or that are ten times too weak.
    overload : float, optional
        Full scale of the acquisition as share of each channel's largest value: what is above is clipped.
    wrong_sign, dead : sequences of Dof
        Response channels with turned polarity, and without a signal.
    """

    noise: float = 0.0
    double_hits: tuple[int, ...] = ()
    weak_hits: tuple[int, ...] = ()
    overload: float | None = None
    wrong_sign: tuple[Dof | str, ...] = ()
    dead: tuple[Dof | str, ...] = ()


@dataclass(frozen=True)
class Hammer:
    """The hammer and the acquisition.

    Parameters
    ----------
    contact : float
        Duration of the half-sine force pulse, s; a soft tip excites up to about 1/contact.
    force : float
        Peak force, N; hits vary by 20 %.
    hits : int
        Per set-up.
    block : float
        Time between hits, s.
    sample_rate : float
        Hz.
    """

    contact: float = 0.006
    force: float = 2000.0
    hits: int = 3
    block: float = 4.0
    sample_rate: float = 400.0

    def __post_init__(self) -> None:
        for name in ("contact", "force", "block", "sample_rate"):
            positive(f"Hammer.{name}", getattr(self, name))
        count("Hammer.hits", self.hits)


@dataclass(frozen=True, eq=False)
class MeasuringPoints:
    """Points on the bodies of a machine where it is struck or measured: name to (body, position in the machine frame, m)."""

    places: Mapping[str | int, tuple[str, FloatArray]] = field(default_factory=dict)

    @property
    def coordinates(self) -> dict[str | int, FloatArray]:
        """Position of every point, m."""
        return {name: position for name, (_, position) in self.places.items()}

    @property
    def components(self) -> dict[str, list[str | int]]:
        """Points of every body."""
        result: dict[str, list[str | int]] = {}
        for name, (body, _) in self.places.items():
            result.setdefault(body, []).append(name)
        return result


def surface_points(machine: Machine, number: int, rng: np.random.Generator) -> MeasuringPoints:
    """Return points spread over the surfaces of the bodies' boxes (drawn or inertial), more on larger ones, numbered from 1."""
    boxes = {name: box for name, body in machine.description.bodies.items() if (box := _box(body)) is not None}
    if not boxes:
        fail("machine", "elastic bodies alone, none drawn as a box", "must have rigid bodies, or bodies drawn as a box",
             remedy="give points by hand")
    areas = np.array([2 * (s[0] * s[1] + s[1] * s[2] + s[0] * s[2]) for _, _, s in boxes.values()])
    points_min = min(MIN_BODY_POINTS, number // len(boxes))
    counts = np.maximum(points_min, np.floor(number * areas / max(areas.sum(), 1e-300))).astype(int)
    while counts.sum() > number:  # many small bodies: the largest give up theirs
        counts[int(np.argmax(counts))] -= 1
    counts[int(np.argmax(areas))] += number - counts.sum()
    places: dict[str | int, tuple[str, FloatArray]] = {}
    for (name, (centre, axes, size)), point_count in zip(boxes.items(), counts, strict=True):
        frame = machine.body_frames[machine.link(name)]
        for _ in range(point_count):
            position = rng.uniform(-0.5, 0.5, 3)
            # One coordinate is set to a face of the unit cube: the point lies on the surface.
            position[rng.integers(3)] = rng.choice([-0.5, 0.5])
            places[len(places) + 1] = (name, tf.move(frame, (centre + axes @ (position * size))[None])[0])
    return MeasuringPoints(places)


def _box(body: BodyDescription) -> tuple[FloatArray, FloatArray, FloatArray] | None:
    """Return centre, axes (columns) and edges of a body's box: drawn or described, else that of a rigid body's inertia."""
    shape = body.draw or body.shape
    if shape is not None and shape.size is not None:
        return np.array(body.centre if body.draw_at is None else body.draw_at), np.eye(3), np.array(shape.size)
    return None if body.is_elastic else equivalent_cuboid(body)


def list_points(machine: Machine) -> MeasuringPoints:
    """Return the points that the machine's file names on its bodies; those of the ground, which does not move, are left out.

    Examples
    --------
    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import (
    ...     BodyDescription,
    ...     InertiaDescription,
    ...     JointDescription,
    ...     MachineDescription,
    ...     PointDescription,
    ... )
    >>> joint = JointDescription("ground", "head", stiffness={"x": 1e7})
    >>> head = BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    >>> machine = build(MachineDescription("slide", {"head": head}, {"slide": joint},
    ...                                    points={"tip": PointDescription("head", (0.0, 0.0, -0.2))}))
    >>> list(list_points(machine).places)
    ['tip']
    """
    places: dict[str | int, tuple[str, FloatArray]] = {}
    for name, point in machine.description.points.items():
        if point.body != GROUND:
            places[name] = (point.body, tf.move(machine.body_frames[machine.link(point.body)], np.array(point.at)[None])[0])
    return MeasuringPoints(places)


def true_modes(machine: Machine, points: MeasuringPoints, ratio: float | ArrayLike, *, pose: Pose | None = None) -> Modes:
    """Return the machine's modes at measuring points in x, y, z, mass-normalised, with these damping ratios: the truth."""
    shapes = body_shapes(machine, pose)
    rows, labels = [], []
    for name, (body, position) in points.places.items():
        moved = tf.move(shapes.place.displacements[0, machine.link(body)], position[None])[0]
        rows.append(tf.point_velocity(moved) @ shapes.twists[machine.link(body)])
        labels += [Dof(name, way) for way in _DIRECTIONS]
    shape = np.concatenate(rows)
    return Modes(shapes.frequency, np.broadcast_to(ratio, shapes.frequency.shape), shape, tuple(labels))


def hammer_records(
    modes: Modes, struck: Dof | str, responses: Sequence[Dof | str], *, rng: np.random.Generator, hammer: Hammer | None = None,
    imperfections: Imperfections | None = None,
) -> Record:
    """Return one record of a set-up: force, then accelerations, as the acquisition would store it.

    The motion is exact for a force that is linear between samples six times finer than the record's; both pass the same
    anti-aliasing filter before they are thinned out, as in a real front end.

    Parameters
    ----------
    modes : Modes
        Real, mass-normalised, viscous: see `true_modes`.
    struck : label
    responses : labels
    rng : numpy.random.Generator
    """
    hammer, faults = hammer or Hammer(), imperfections or Imperfections()
    labels, driven = dofs(responses), dofs([struck])
    fine = hammer.sample_rate * _FORCE_OVERSAMPLING
    force = _hammer_force(hammer, faults, fine, rng)
    system = _accelerations(modes, driven, labels)
    # The response to the filtered force is the filtered response: only the samples that are kept are computed.
    filtered, delay, kept = _filter_force(force)
    motion = time_response.exact(system, filtered[:, None], fine, stride=_FORCE_OVERSAMPLING)
    channels = np.concatenate([filtered[::_FORCE_OVERSAMPLING, None], motion], axis=1)[delay:delay + kept]
    channels = _add_imperfections(channels, labels, faults, rng)
    return Record(channels, hammer.sample_rate, (driven[0], *labels), ("force", *("acceleration",) * len(labels)),
                  name=f"virtual hammer at {driven[0]}")


def _hammer_force(hammer: Hammer, faults: Imperfections, rate: float, rng: np.random.Generator) -> FloatArray:
    total = np.zeros(round((hammer.hits * hammer.block + 0.5) * rate))
    for hit in range(hammer.hits):
        # Not on the beat: blows at the same sample of every block would hide what a trigger and a window do.
        start = 0.3 + hit * hammer.block + rng.uniform(-0.02, 0.02)
        size = hammer.force * (1 + 0.2 * rng.uniform(-1, 1)) * (0.1 if hit in faults.weak_hits else 1.0)
        _add_pulse(total, start, size, hammer.contact, rate)
        if hit in faults.double_hits:
            # A rebound comes after some contact times with less than half of the force: near enough to pass for one blow.
            _add_pulse(total, start + 6 * hammer.contact, 0.4 * size, hammer.contact, rate)
    return total


def _add_pulse(total: FloatArray, start: float, size: float, contact: float, rate: float) -> None:
    samples = np.arange(int(start * rate), int((start + contact) * rate) + 2)
    phase = (samples / rate - start) / contact
    total[samples] += np.where((phase > 0) & (phase < 1), size * np.sin(np.pi * phase), 0.0)


def _accelerations(modes: Modes, struck: tuple[Dof, ...], responses: tuple[Dof, ...]) -> StateSpace:
    n, w, zeta = modes.count, modes.omega, modes.damping_ratio
    left, right = modes.shape_at(responses), modes.shape_at(struck)
    a = np.block([[np.zeros((n, n)), np.eye(n)], [-np.diag(w**2), -np.diag(2 * zeta * w)]])
    b = np.concatenate([np.zeros((n, 1)), right.T])
    return StateSpace(a, b, np.concatenate([-left * w**2, -left * 2 * zeta * w], axis=1), left @ right.T)


def _filter_force(force: FloatArray) -> tuple[FloatArray, int, int]:
    """Return the force behind the anti-aliasing filter at the fine rate, the filter's delay and the number of kept samples."""
    # Cut off at 0.8 of half the rate, as acquisition systems do: the filter's slope needs the rest.
    taps = firwin(40 * _FORCE_OVERSAMPLING + 1, 0.8 / _FORCE_OVERSAMPLING)
    # The filter's delay is a whole number of output samples, so that thinning and shifting can be done at once.
    return fftconvolve(force, taps), len(taps) // 2 // _FORCE_OVERSAMPLING, -(-len(force) // _FORCE_OVERSAMPLING)


def _add_imperfections(channels: FloatArray, labels: tuple[Dof, ...], faults: Imperfections,
                       rng: np.random.Generator) -> FloatArray:
    result = channels.copy()
    for dof in dofs(faults.wrong_sign):
        if dof in labels:
            result[:, 1 + labels.index(dof)] *= -1
    for dof in dofs(faults.dead):
        if dof in labels:
            result[:, 1 + labels.index(dof)] = 0.0
    result += faults.noise * np.sqrt((channels**2).mean(axis=0)) * rng.normal(size=result.shape)
    if faults.overload is not None:
        limit = faults.overload * np.abs(channels).max(axis=0)
        result = np.clip(result, -limit, limit)
    return floats("channels", result)
