r"""Virtual point: six motions and six loads of an interface from sensors and blows around it that a rigid patch follows.

Sensors :math:`u = R q`, so :math:`q = (R^T W R)^{-1} R^T W u`; loads :math:`m = R^T f`. What a sensor shows beside
R q is motion that the patch does not make as a rigid one, or a fault. Source: van der Seijs, van den Bosch, Rixen, de Klerk,
IMAC 2013 (CHaMP).
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import FloatArray, ToolpointWarning, fail, floats
from toolpoint._doubt import Doubt
from toolpoint.spatial.rotation import skew
from toolpoint.vibration import Dof, Frf

DIRECTIONS = ("+x", "+y", "+z", "+rx", "+ry", "+rz")
MIN_SENSOR_CONSISTENCY = 0.9  # share of a sensor's motion that the rigid patch makes, below which the sensor is doubted
MIN_GEOMETRY_SINGULAR_RATIO = 1e-6  # smallest over largest singular value with which the labels tell all directions apart


@dataclass(frozen=True, eq=False)
class VirtualPoint:
    """Rigid interface and the sensors and blows that were measured around it.

    Parameters
    ----------
    name : str
        The point's name in the result.
    position : (3,) floats
        m, machine frame.
    sensors, blows : Dofs or labels
        Outputs and inputs of the measurement that belong to it.
    places : mapping of point name to (3,) position, m
    ways : directions of the virtual point in the result; all six where left out

    Examples
    --------
    Two sensors along z, 0.1 m apart in x, tell the deflection from the rotation about y (which moves a place at +x down):

    >>> point = VirtualPoint("tcp", [0, 0, 0], ["a:+z", "b:+z"], [], {"a": [-0.05, 0, 0], "b": [0.05, 0, 0]}, ("+z", "+ry"))
    >>> point.directions(["a:+z", "b:+z"], "sensors").tolist()
    [[1.0, 0.05], [1.0, -0.05]]
    """

    name: str
    position: ArrayLike
    sensors: Sequence[Dof | str]
    blows: Sequence[Dof | str]
    places: Mapping[str | int, ArrayLike]
    ways: tuple[str, ...] = DIRECTIONS

    def directions(self, labels: Sequence[Dof | str], what: str) -> FloatArray:
        """Return the motion of labelled places per motion of the point, (n_labels, n_ways).

        Raises ToolpointError where a label has no place, or the labels cannot tell all `ways` apart.
        """
        origin = floats("position", self.position, (3,))
        rows = []
        for label in labels:
            dof = label if isinstance(label, Dof) else Dof.parse(label)
            if dof.point not in self.places:
                fail(what, f"no place of point {dof.point}", "every sensor and blow needs its position",
                     remedy="add it to `places`")
            arm = floats(f"places[{dof.point!r}]", self.places[dof.point], (3,)) - origin
            # v = v_0 + w x arm, w = w_0: the motion of a place on the rigid patch.
            carry = np.block([[np.eye(3), -skew(arm)], [np.zeros((3, 3)), np.eye(3)]])
            rows.append(dof.unit @ carry)
        matrix = np.array(rows)[:, [DIRECTIONS.index(way) for way in self.ways]]
        reach = max(float(np.abs(matrix).max()), 1e-300)
        scale = np.array([reach / max(float(np.abs(matrix[:, k]).max()), 1e-300) for k in range(matrix.shape[1])])
        singular = np.linalg.svd(matrix * scale, compute_uv=False)
        if len(matrix) < matrix.shape[1] or singular[-1] < MIN_GEOMETRY_SINGULAR_RATIO * singular[0]:
            fail(what, f"{len(matrix)} labels that span "
                 f"{int((singular > MIN_GEOMETRY_SINGULAR_RATIO * singular[0]).sum())} directions",
                 f"must tell {matrix.shape[1]} apart ({', '.join(self.ways)})",
                 remedy="add places off the line of the others, or ask for fewer `ways`")
        return matrix


def reduce_to_points(frf: Frf, points: Sequence[VirtualPoint]) -> Frf:
    """Transform responses to virtual points, q = (R^T R)^-1 R^T u; labels that belong to none stay as they are.

    The consistency of every sensor (share of its motion that the rigid patch makes, over all lines and inputs) is noted; one
    below 0.9 warns.

    Raises ToolpointError for sensors or blows that were not measured, or that cannot tell the directions apart.

    Examples
    --------
    >>> import numpy as np
    >>> from toolpoint.vibration import Frf
    >>> labels, places = ["a:+z", "b:+z"], {"a": [-0.05, 0, 0], "b": [0.05, 0, 0]}
    >>> frf = Frf([10.0], np.array([[[3e-6, 1e-6], [1e-6, 3e-6]]]), labels, labels)
    >>> virtual = reduce_to_points(frf, [VirtualPoint("tcp", [0, 0, 0], labels, labels, places, ("+z", "+ry"))])
    >>> [f"{value.real:.3g}" for value in virtual.values[0].diagonal()]  # m/N and rad/(N m)
    ['2e-06', '0.0004']
    """
    lines = frf.converted_to("receptance")
    left, outputs = _transformation(lines.outputs, points, True)
    right, inputs = _transformation(lines.inputs, points, False)
    values = left @ lines.values @ right.T
    notes = [*lines.notes, *(_consistency(lines, point) for point in points)]
    variance = None if lines.variance is None else (left**2) @ lines.variance @ (right**2).T
    draws = None if lines.draws is None else left @ lines.draws @ right.T
    return replace(lines, values=values, outputs=outputs, inputs=inputs, notes=tuple(notes), variance=variance, coherence=None,
                   draws=draws)


def _transformation(labels: Sequence[Dof], points: Sequence[VirtualPoint], is_output: bool
                    ) -> tuple[FloatArray, tuple[Dof, ...]]:
    rows, result, used = [], [], set()
    for point in points:
        members = [d if isinstance(d, Dof) else Dof.parse(d) for d in (point.sensors if is_output else point.blows)]
        absent = [str(d) for d in members if d not in labels]
        if absent:
            fail(f"virtual point {point.name}", f"no {', '.join(absent)} measured",
                 f"must be {'outputs' if is_output else 'inputs'} of the responses")
        part = np.linalg.pinv(point.directions(members, f"virtual point {point.name}"))
        matrix = np.zeros((len(point.ways), len(labels)))
        matrix[:, [list(labels).index(d) for d in members]] = part
        rows.append(matrix)
        result += [Dof(point.name, way) for way in point.ways]
        used |= set(members)
    for index, label in enumerate(labels):
        if label not in used:
            rows.append(np.eye(len(labels))[index:index + 1])
            result.append(label)
    return np.concatenate(rows), tuple(result)


def _consistency(frf: Frf, point: VirtualPoint) -> str:
    matrix = point.directions(point.sensors, f"virtual point {point.name}")
    columns = [list(frf.outputs).index(d if isinstance(d, Dof) else Dof.parse(d)) for d in point.sensors]
    measured = frf.values[:, columns]
    rigid = (matrix @ np.linalg.pinv(matrix)) @ measured
    # Of each sensor: 1 - |rest|^2 / |motion|^2 over all lines and inputs.
    inconsistency = (np.abs(measured - rigid) ** 2).sum(axis=(0, 2)) / np.maximum((np.abs(measured) ** 2).sum(axis=(0, 2)),
                                                                                  1e-300)
    index = int(np.argmax(inconsistency))
    share, label = 1 - float(inconsistency[index]), str(point.sensors[index])
    what, why = f"virtual point {point.name}", f"least consistency {share:.4f}, of sensor {label}"
    if share >= MIN_SENSOR_CONSISTENCY:
        return f"{what}: {why}"
    doubt = Doubt(what, why, "the patch bends there, or sign, direction or place of the sensor is wrong", figure=1 - share)
    warnings.warn(doubt, ToolpointWarning, stacklevel=4)
    return doubt
