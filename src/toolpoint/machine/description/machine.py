"""The description of a machine: plain frozen data, one to one with the YAML file, SI units.

Points of a body are in its frame (see `body`); joint frames are in the machine frame at the reference pose (all axes at zero).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, is_dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from toolpoint._check import FloatArray, ToolpointError, scalar, suggestion
from toolpoint._doubt import Doubt
from toolpoint.joints.law import LawDescription
from toolpoint.machine.description.body import (
    ELASTIC_KINDS,
    MACHINE_FRAME,
    SCALING_KEYS,
    BodyDescription,
    FrameDescription,
    Vector,
)

if TYPE_CHECKING:  # a machine holds its cut as it is; who charts it brings the cutting room
    from toolpoint.cutting.description import CuttingDescription

Matrix = tuple[tuple[float, ...], ...]
GROUND = "ground"


@dataclass(frozen=True)
class JointDescription:
    """A joint between a parent and a child body; directions not named are locked, values per direction in SI.

    `law` (guideway, ball screw, bearing, contact) computes the stiffness; directions that it leaves must be `free` or have
    `stiffness` of their own.

    `screws` are free twists (v, w) of six numbers in the joint's frame, any number of them, in place of directions; then
    `stiffness_matrix` and `damping_matrix` are over them.

    `elastic_at` says which side carries the springs of a driven joint: ``child`` (they travel with it) or ``parent``.
    `closes_loop` marks a joint whose child already hangs on another joint. Free directions of joints on a loop, and those named
    `passive` (which may have springs), follow the loop at every pose, rotations in the order written; `limits` (m, rad) and
    `largest_tilt` (rad, between the z axes of both sides of a loop joint) say how far.
    `placed` is false where a file says nowhere where the joint is, so that 0, 0, 0 is assumed.

    >>> guide = JointDescription("bed", "table", stiffness={"x": 2e8, "z": 1e9}, loss_factor=0.02)
    >>> guide.stiffness.get("y") is None  # not named, so locked
    True
    """

    parent: str
    child: str
    frame: FrameDescription = MACHINE_FRAME
    stiffness: Mapping[str, float] = field(default_factory=dict)
    damping: Mapping[str, float] = field(default_factory=dict)
    loss_factor: Mapping[str, float] | float = 0.0
    free: tuple[str, ...] = ()
    stiffness_matrix: Matrix | None = None
    damping_matrix: Matrix | None = None
    elastic_at: str = "child"
    closes_loop: bool = False
    parent_interface: str | None = None
    child_interface: str | None = None
    source: str = ""
    passive: tuple[str, ...] = ()
    limits: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    largest_tilt: float | None = None
    screws: Matrix = ()
    law: LawDescription | None = None
    placed: bool = field(default=True, compare=False)


@dataclass(frozen=True)
class DrivenDirection:
    """A joint direction that an axis drives, by `factor` m or rad for every m or rad of the axis.

    >>> gantry = AxisDescription("left rail", "y", drives=(DrivenDirection("right rail", "y"),))
    >>> [part.joint for part in gantry.moved]
    ['left rail', 'right rail']
    """

    joint: str
    direction: str
    factor: float = 1.0


@dataclass(frozen=True)
class AxisDescription:
    """An axis: the joint and direction that it moves, or several in `drives`, and its limits in m or rad.

    `at_reference` is what the axis shows at the reference pose.

    >>> AxisDescription("swivel", "rx", limits=(-2.0, 2.0)).is_rotary
    True
    """

    joint: str = ""
    direction: str = ""
    limits: tuple[float, float] = (float("-inf"), float("inf"))
    drives: tuple[DrivenDirection, ...] = ()
    at_reference: float = 0.0

    @property
    def moved(self) -> tuple[DrivenDirection, ...]:
        """Every joint direction that the axis drives."""
        return (DrivenDirection(self.joint, self.direction), *self.drives) if self.joint else self.drives

    @property
    def is_rotary(self) -> bool:
        """Whether the axis is an angle: that of the first direction that it drives."""
        return bool(self.moved) and "r" in self.moved[0].direction


@dataclass(frozen=True)
class CoordinateDescription:
    """A coordinate of the tool: ``x y z tilt azimuth torsion``, with limits in m or rad.

    >>> CoordinateDescription("tilt", limits=(0.0, 0.7)).limits  # rad
    (0.0, 0.7)
    """

    coordinate: str
    limits: tuple[float, float] = (float("-inf"), float("inf"))


@dataclass(frozen=True)
class TaskDescription:
    """Coordinates of a point and of the tool's direction, in which the machine may be posed in place of some of its axes.

    >>> coordinates = {name: CoordinateDescription(name) for name in ("x", "y", "z")}
    >>> legs = TaskDescription("tool", ("leg 1", "leg 2", "leg 3"), coordinates)
    >>> len(legs.axes) == len(legs.coordinates)  # as many coordinates as axes that they replace
    True
    """

    point: str
    axes: tuple[str, ...]
    coordinates: Mapping[str, CoordinateDescription] = field(default_factory=dict)


@dataclass(frozen=True)
class PointDescription:
    """A named point on a body, in the body's frame, m; on an elastic body an interface instead.

    >>> PointDescription("head", at=(0.0, 0.0, -0.3)).interface is None  # a place on a rigid body
    True
    """

    body: str
    at: Vector = (0.0, 0.0, 0.0)
    interface: str | None = None


@dataclass(frozen=True)
class LoadDescription:
    """A constant force (N, machine frame) and moment (N m) at a named point.

    >>> weight = LoadDescription("vice", force=(0.0, 0.0, -20.0 * 9.81))
    >>> round(weight.force[2], 1)
    -196.2
    """

    point: str
    force: Vector = (0.0, 0.0, 0.0)
    moment: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class ReferenceDescription:
    """Natural frequencies (Hz) from a test or another model, to compare with; `damping_ratio` where known.

    >>> ReferenceDescription("hammer test", (41.0, 63.5), source="measured 2026-03-02").is_measured
    True
    """

    name: str
    frequencies: tuple[float, ...]
    damping_ratio: tuple[float, ...] = ()
    source: str = ""

    @property
    def is_measured(self) -> bool:
        """Whether it is from a test of this machine, and not from a publication or another model."""
        return self.source.startswith("measured")


@dataclass(frozen=True)
class IdentifiedDescription:
    """Numbers of a machine that were identified together: their paths (``joints.guide.stiffness.x``), and their covariance
    as the rows of its lower triangle, in the units of the numbers (SI).

    >>> pair = IdentifiedDescription(("joints.guide.stiffness.x", "joints.guide.stiffness.z"), ((4.0,), (1.0, 9.0)))
    >>> pair.matrix.tolist()
    [[4.0, 1.0], [1.0, 9.0]]
    """

    parameters: tuple[str, ...]
    covariance: Matrix
    source: str = ""

    @property
    def matrix(self) -> FloatArray:
        """The covariance, shape (n, n)."""
        result = np.zeros((len(self.parameters),) * 2)
        result[np.tril_indices(len(result))] = [value for row in self.covariance for value in row]
        return result + np.tril(result, -1).T


@dataclass(frozen=True)
class MachineDescription:
    """A machine: bodies joined by joints, moved by axes, seen at points.

    `tool_axis` is the direction of the tool's axis, away from the work, fixed in the tool's body, machine frame at the
    reference pose. `assembly_modes` are other ways in which the loops close: name to start values of passive directions
    (``knuckle.rx``: rad); `assembly_mode` names the one in use.
    `modal_damping` damps mode by mode, so that shapes are real: ``energy`` (by the share of joints in a mode's strain energy),
    or the damping ratios of the modes at the reference pose.
    `doubts` are those of the study that made the description: every result that rests on it repeats them. `up` is a unit
    direction of the machine frame, against which gravity acts where only its size is given (`gravity.gravity_of`).
    `reduction_error` is what condensed castings and solids may err by in frequencies, 0 keeps all their shapes (`condense`).

    >>> slide = MachineDescription("slide", {"table": BodyDescription(100.0)},
    ...                            {"guide": JointDescription("ground", "table", stiffness={"x": 1e7})})
    >>> slide.with_values({"joints.guide.stiffness.x": 2e7}).value("joints.guide.stiffness.x")
    20000000.0
    """

    name: str
    bodies: Mapping[str, BodyDescription]
    joints: Mapping[str, JointDescription]
    axes: Mapping[str, AxisDescription] = field(default_factory=dict)
    points: Mapping[str, PointDescription] = field(default_factory=dict)
    gravity: Vector | None = None
    loads: tuple[LoadDescription, ...] = ()
    tool: str | None = None
    table: str | None = None
    damping_ratio: float | None = None
    cutting: CuttingDescription | None = None
    reference: tuple[ReferenceDescription, ...] = ()
    poses: tuple[Mapping[str, float], ...] = ()
    description: str = ""
    source: str = ""
    assumptions: tuple[str, ...] = ()
    tool_axis: Vector = (0.0, 0.0, 1.0)
    task: TaskDescription | None = None
    assembly_modes: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    assembly_mode: str = ""
    identified: IdentifiedDescription | None = None
    doubts: tuple[Doubt, ...] = ()
    modal_damping: str | tuple[float, ...] = ""
    up: Vector = (0.0, 0.0, 1.0)
    reduction_error: float | None = None

    def with_values(self, values: Mapping[str, float]) -> MachineDescription:
        """Return the machine with parameters changed, by path: ``joints.foundation.stiffness.rx`` and so on.

        An entry of a stiffness or damping matrix is changed with its mirror image, so that the matrix stays symmetric.
        """
        result: Any = self
        if not isinstance(values, Mapping):
            raise ToolpointError(f"values: {values!r}; must map paths to numbers: {{'joints.NAME.stiffness.rx': 9e8}}")
        for path, value in values.items():
            result = _changed(result, path.split("."), value, path)
            if (other := _mirrored(path)) != path:
                result = _changed(result, other.split("."), value, other)
        return result

    def value(self, path: str) -> float:
        """Return one parameter by path."""
        part: Any = self
        for key in path.split("."):
            part = _child(part, key, path)
        if part is None:
            raise ToolpointError(f"{path}: not given; what stands for it comes from elsewhere (a material, a shape): write it "
                                 "in the file to look at it or vary it")
        if isinstance(part, bool) or not isinstance(part, (int, float)):
            raise ToolpointError(f"{path}: not a number but {type(part).__name__}; give a path to a number, "
                                 f"for example {next(iter(parameters(self)), 'joints.NAME.stiffness.rx')}")
        return float(part)


def parameters(machine: MachineDescription) -> Iterator[str]:
    """Yield the paths of all numbers of the bodies and joints, in file order.

    >>> slide = MachineDescription("slide", {"table": BodyDescription(100.0)},
    ...                            {"guide": JointDescription("ground", "table", stiffness={"x": 1e7})})
    >>> [path for path in parameters(slide) if "stiffness" in path or "mass" in path]
    ['bodies.table.mass', 'joints.guide.stiffness.x']
    """
    for room in ("bodies", "joints"):
        for name, part in getattr(machine, room).items():
            for path in _numbers(part):
                yield f"{room}.{name}.{path}"


def _numbers(part: Any) -> Iterator[str]:
    if is_dataclass(part):
        # What laws, meshes and patches make of their numbers is changed by path, not listed.
        items = [(f.name, getattr(part, f.name)) for f in fields(part) if f.name not in ("law", *ELASTIC_KINDS)]
        for kind, field_name in SCALING_KEYS.items():
            if getattr(part, kind, None) is not None:
                yield from (f"{kind}.{field_name}.{path}" for path in _numbers(getattr(getattr(part, kind), field_name)))
    elif isinstance(part, Mapping):
        items = list(part.items())
    elif isinstance(part, tuple):
        items = [(str(i), value) for i, value in enumerate(part)]
    else:
        return
    for name, value in items:
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            yield str(name)
        elif is_dataclass(value) or isinstance(value, (Mapping, tuple)):
            for path in _numbers(value):
                yield f"{name}.{path}"


def _child(part: Any, key: str, path: str) -> Any:
    """Return what a key names in a part; refuse an unknown one with the nearest known."""
    if is_dataclass(part):
        names = [f.name for f in fields(part)]
        if key in names:
            return getattr(part, key)
    elif isinstance(part, Mapping):
        names = list(part)
        if key in part:
            return part[key]
    elif isinstance(part, tuple):
        names = [str(i) for i in range(len(part))]
        if key in names:
            return part[int(key)]
    else:
        names = []
    hint = suggestion(key, names)
    known_text = f"; known: {', '.join(names)}" if names else ""
    raise ToolpointError(f"{path}: no {key!r} there{known_text}" + (f" ({hint})" if hint else ""))


def _mirrored(path: str) -> str:
    """Return the path of the mirror image of an entry of a symmetric matrix, any other path as it is."""
    *start, name, row, column = ["", "", *path.split(".")]
    return ".".join([*start[2:], name, column, row]) if name in ("stiffness_matrix", "damping_matrix") else path


def _number(value: Any, path: str) -> float:
    if isinstance(value, (bool, str)) or np.ndim(value) != 0:
        raise ToolpointError(f"{path}: {value!r}; must be one number in SI; units are read in machine files only, in Python "
                             "write 9e8 for '9e8 N*m/rad' (or use toolpoint.io.quantities.units.quantity)")
    return scalar(path, value)


def _changed(part: Any, keys: list[str], value: float, path: str) -> Any:
    old = _child(part, keys[0], path)
    if len(keys) > 1:
        new = _changed(old, keys[1:], value, path)
    elif isinstance(old, (int, float)) and not isinstance(old, bool):
        new = _number(value, path)
    else:
        raise ToolpointError(f"{path}: not a number but {type(old).__name__}; only numbers can be changed by path")
    if is_dataclass(part) and not isinstance(part, type):
        return replace(part, **{keys[0]: new})
    if isinstance(part, Mapping):
        return {**part, keys[0]: new}
    return tuple(new if i == int(keys[0]) else entry for i, entry in enumerate(part))
