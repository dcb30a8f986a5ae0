"""Comparison of a test with a machine: measured modes and responses, their points paired with the machine's."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from toolpoint._check import FloatArray, ToolpointError
from toolpoint._notebook import NotebookText
from toolpoint.machine import Machine
from toolpoint.machine.pose.named_points import point_positions
from toolpoint.modal_identification import identify, real_modes
from toolpoint.studies.measured.model_correlation import ModelCorrelation, correlate, with_measured_points
from toolpoint.studies.measured.point_pairing import PointPairing, pair_points
from toolpoint.studies.measured.point_registration import register_anywhere
from toolpoint.vibration import Frf, Modes
from toolpoint.vibration.geometry import Geometry

Point = str | int


@dataclass(frozen=True, eq=False)
class MeasuredTest:
    """Data of a test: real modes, responses where there are any, geometry, and the points of every body where known."""

    modes: Modes
    frf: Frf | None = None
    geometry: Geometry | None = None
    owner: Mapping[str, Sequence[Point]] | None = None


def gather_test(modes: Modes | None = None, frf: Frf | None = None, *, geometry: Geometry | None = None,
                  owner: Mapping[str, Sequence[Point]] | None = None, band: tuple[float, float] | None = None) -> MeasuredTest:
    """Return the data of a test, with the modes identified from the responses where none are given, within a band (Hz).

    geometry : where the points are; owner : body of the machine to the measured points that ride on it.

    Examples
    --------
    >>> gather_test(Modes([80.0, 120.0], [0.02, 0.03], [[0.1, 0.05]], ["tool:+x"])).modes.count
    2
    """
    if modes is None:
        if frf is None:
            raise ToolpointError("correlate: no file with modes or responses given")
        modes = identify(frf, band=band).modes
    if frf is not None and band is not None:
        frf = frf.between(*band)
    if owner is not None and geometry is None:
        raise ToolpointError("`components`: needs `geometry` for the positions of the points")
    return MeasuredTest(real_modes(modes), frf, geometry, owner)


@dataclass(frozen=True, eq=False)
class Comparison(NotebookText):
    """Correlation of a machine with a test, and that of an earlier machine where one was given.

    machine : with the points that the test was paired with.
    """

    correlation: ModelCorrelation
    earlier: ModelCorrelation | None
    machine: Machine
    test: MeasuredTest
    pose: Mapping[str, float] | None = None

    def table(self) -> str:
        """Return pairs, coefficients and points as text."""
        return self.correlation.table()

    def to_dict(self) -> dict[str, Any]:
        """Return the numbers of the correlation as plain data; transform in m, frequencies in Hz."""
        return self.correlation.to_dict()


def compare_with_test(machine: Machine, test: MeasuredTest, *, pose: Mapping[str, float] | None = None,
            known_pairs: Mapping[str, str] | None = None, furthest: float = 0.05, earlier: Machine | None = None,
            lowest_mac: float = 0.5) -> Comparison:
    """Correlate a machine with a test.

    Parameters
    ----------
    machine, earlier : Machine
        The earlier one is shown beside, for example the machine before an update.
    test : MeasuredTest
        With `owner` the measured points ride on the machine's bodies; otherwise they are paired with the machine's named
        points, by `known_pairs` or by registration from where they are; without a geometry equal names are the same
        points.
    known_pairs : mapping of measured point to point of the machine, optional
    furthest : float
        Points further apart stay single, m.
    lowest_mac : float
        Modes below are not paired.

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
    >>> machine = build(MachineDescription("slide", {"head": head}, {"slide": joint}, points={"tip": PointDescription("head")}))
    >>> result = compare_with_test(machine, gather_test(Modes([52.0], [0.02], [[0.1]], ["tip:+x"])))
    >>> result.correlation.mac.round(6).tolist()
    [[1.0]]
    """
    now, drawn = _correlate_points(machine, test, known_pairs, furthest, pose, lowest_mac)
    old = None if earlier is None else _correlate_points(earlier, test, known_pairs, furthest, pose, lowest_mac)[0]
    return Comparison(now, old, drawn, test, pose)


def _correlate_points(machine: Machine, test: MeasuredTest, known_pairs: Mapping[str, str] | None, furthest: float,
                      pose: Mapping[str, float] | None, lowest_mac: float) -> tuple[ModelCorrelation, Machine]:
    pairing: PointPairing | None = None
    if test.owner is not None and test.geometry is not None:
        machine = with_measured_points(machine, test.geometry.points, test.owner)
    elif test.geometry is not None:
        # A point of the geometry without a shape has nothing to compare.
        measured = {d.point for d in test.modes.dofs}
        places = {name: position for name, position in test.geometry.points.items() if name in measured}
        model_places = point_positions(machine, pose)
        # Known pairs fix the transform; without them every start of the registration is tried.
        start, doubts = (None, ()) if known_pairs else register_anywhere(places, model_places, furthest)
        pairing = replace(pair_points(places, model_places, furthest, known_pairs=_pairs_by_label(known_pairs, places),
                                      start=start), doubts=doubts)
    return correlate(machine, test.modes, pairing, frf=test.frf, pose=pose, lowest_mac=lowest_mac), machine


def _pairs_by_label(known_pairs: Mapping[str, str] | None, places: Mapping[Point, FloatArray]) -> dict[Point, Point] | None:
    if not known_pairs:
        return None
    # Pairs are text, where the points of a geometry may be numbers.
    number = {str(name): name for name in places}
    return {number.get(key, key): value for key, value in known_pairs.items()}
