"""JointEstimate: position, freedoms, directions and kind of one joint as plain data, with uncertainty and doubts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from toolpoint._check import FloatArray
from toolpoint.joint_identification.joint_fit import JointFit
from toolpoint.joint_identification.measured import about
from toolpoint.joint_identification.relative_motion import RelativeMotion

Z95 = 1.959964


@dataclass(frozen=True, eq=False)
class JointEstimate:
    """One joint.

    Parameters
    ----------
    parent, child : str
    kind : str
        ``locked``, ``hinge``, ``slide``, ``cylindrical``, ``universal``, ``spherical``, ``planar`` or ``general``.
    position : (3,) floats
        Point of the joint, m: of an axis the point nearest to the middle between the two components.
    position_covariance : (3, 3) floats
        m^2; zero along directions that the kind does not determine (see `undetermined`).
    undetermined : (n, 3) floats
        Directions along which the position is a choice (along a hinge's axis; all for a slide).
    axis : (3,) floats
        Unit vector that the data determine: the axis; the common normal of a universal joint's two rotations; the normal
        of a plane; zero where there is none (locked, spherical, general).
    axis_covariance : (3, 3) floats
        Of the axis, rad^2; zero along itself.
    frame : (3, 3) floats
        Columns x, y, z of the joint frame: the frame nearest to the machine's that has `axis` among its axes.
    freedoms : tuple of str
        Free directions in the joint frame, of x y z rx ry rz; empty for a locked and for a general joint.
    screws : (6, f) floats
        Free twists (v, w) about the machine's origin, in the order of `freedoms`; of a general joint any basis.
    stiffness, stiffness_deviation : (f,) floats or None
        N m/rad or N/m for every freedom, with its standard deviation, where masses are known.
    stiffness_matrix, stiffness_matrix_deviation : (f, f) floats or None
        Of a general joint: the symmetric stiffness over its free twists `screws`, with the standard deviation of every entry
        (against the true one over the nearest twists that are truly free), where masses are known and the data decide it.
    probability : float
        Of a misfit so large by noise alone.
    alternatives : tuple of str
        Other kinds with as many freedoms that the data do not refuse.
    doubts : tuple of str
        Why this may not be so; empty for a joint that the data establish.
    """

    parent: str
    child: str
    kind: str
    position: FloatArray
    position_covariance: FloatArray
    undetermined: FloatArray
    axis: FloatArray
    axis_covariance: FloatArray
    frame: FloatArray
    freedoms: tuple[str, ...]
    screws: FloatArray
    probability: float
    alternatives: tuple[str, ...] = ()
    stiffness: FloatArray | None = None
    stiffness_deviation: FloatArray | None = None
    doubts: tuple[str, ...] = ()
    stiffness_matrix: FloatArray | None = None
    stiffness_matrix_deviation: FloatArray | None = None

    @property
    def spatial_stiffness(self) -> FloatArray | None:
        """Stiffness (6, 6) for twists (v, w) at `position` in the machine's axes; of six free twists only, else None.

        With fewer, the other directions are rigid, and no finite matrix of six by six says so.
        """
        if self.stiffness_matrix is None or self.screws.shape[1] < 6:
            return None
        back = np.linalg.solve(self.screws, about(self.position, 1.0))
        return np.asarray(back.T @ self.stiffness_matrix @ back)

    @property
    def directions(self) -> FloatArray:
        """Unit direction of every freedom, shape (f, 3)."""
        return np.array([self.frame[:, "xyz".index(name[-1])] for name in self.freedoms]).reshape(-1, 3)

    @property
    def rotation(self) -> FloatArray:
        """Angles (a, b, c), rad, of the joint frame Rz(a) Ry(b) Rx(c), as `spatial.rotation.from_euler("zyx", ...)`."""
        return np.asarray(Rotation.from_matrix(self.frame).as_euler("ZYX"))

    @property
    def position_interval(self) -> FloatArray:
        """Half width of the 95 % interval of each coordinate of the position, m."""
        return Z95 * np.sqrt(np.clip(np.diag(self.position_covariance), 0, None))

    @property
    def position_text(self) -> str:
        """The position in mm with its 95 % half widths; ``free`` where the kind leaves a coordinate open."""
        words = []
        for k, (value, half) in enumerate(zip(1e3 * self.position, 1e3 * self.position_interval, strict=True)):
            if np.linalg.norm(self.undetermined[:, k]) > 0.9:
                words.append(f"{value:.0f} (free)")
            else:
                decimals = 1 if half <= 0 else int(min(max(1 - np.floor(np.log10(half)), 0), 4))
                words.append(f"{value:.{decimals}f} ± {half:.{decimals}f}")
        return ", ".join(words)

    @property
    def axis_deviation(self) -> float:
        """Standard deviation of the axis' direction in its less certain way, rad."""
        return float(np.sqrt(max(np.linalg.eigvalsh(self.axis_covariance)[-1], 0.0)))

    @property
    def stiffness_interval(self) -> FloatArray | None:
        """Half width of the 95 % interval of each stiffness."""
        return None if self.stiffness_deviation is None else Z95 * self.stiffness_deviation

    @property
    def certain(self) -> bool:
        """Whether nothing speaks against the joint."""
        return not self.doubts

    @property
    def status(self) -> str:
        """What the estimate is worth, and what to do about it."""
        return "established" if self.certain else "doubtful: " + "; ".join(self.doubts)

    def as_dict(self) -> dict[str, Any]:
        """Return plain data (lists, numbers, names; SI, rad) from which a caller can write a machine description."""
        result: dict[str, Any] = {
            "parent": self.parent, "child": self.child, "kind": self.kind, "at": self.position.tolist(),
            "rotation_zyx": self.rotation.tolist(), "freedoms": list(self.freedoms), "directions": self.directions.tolist(),
            "status": self.status}
        if self.stiffness is not None:
            result["stiffness"] = dict(zip(self.freedoms, self.stiffness.tolist(), strict=True))
        if self.stiffness_matrix is not None:
            result |= {"screws": self.screws.tolist(), "stiffness_matrix": self.stiffness_matrix.tolist()}
        return result

    def __repr__(self) -> str:
        at = self.position_text
        free = ", ".join(self.freedoms) or f"{self.screws.shape[1]} screws"
        return f"JointEstimate({self.child!r} on {self.parent!r}: {self.kind}, free {free}, at {at} mm, {self.status})"


def estimate_joint(motion: RelativeMotion, fits: list[JointFit], doubts: tuple[str, ...]) -> JointEstimate:
    """Return the joint of the best fit in machine coordinates, with the uncertainty of its parameters carried over."""
    fit = fits[0]
    point, axis = fit.chart.place(fit.theta)
    slope_point, slope_axis = _slopes(fit)
    frame, names = joint_frame(fit.kind, axis)
    spread = slope_axis @ fit.covariance @ slope_axis.T
    return JointEstimate(
        motion.parent, motion.child, fit.kind, motion.centre + motion.size * point,
        motion.size**2 * slope_point @ fit.covariance @ slope_point.T, _undetermined(fit.kind, frame, axis),
        axis * _sign(axis), spread, frame, names,
        free_twists(motion, fit, frame, names=names), fit.probability, tuple(other.kind for other in fits[1:]), doubts=doubts)


def free_twists(motion: RelativeMotion, fit: JointFit, frame: FloatArray, *, names: tuple[str, ...]) -> FloatArray:
    """Return the free twists (6, f) about the origin: along and about the joint frame's axes, or a general basis."""
    if fit.kind == "general":
        basis = about(motion.centre, motion.size) @ fit.chart.basis(fit.theta)
        return np.asarray(np.linalg.qr(basis)[0])
    point = motion.centre + motion.size * fit.chart.place(fit.theta)[0]
    result = np.zeros((6, len(names)))
    for i, name in enumerate(names):
        d = frame[:, "xyz".index(name[-1])]
        result[:, i] = np.concatenate([np.cross(point, d), d] if name[0] == "r" else [d, np.zeros(3)])
    return result


def joint_frame(kind: str, axis: FloatArray) -> tuple[FloatArray, tuple[str, ...]]:
    """Return the frame (3, 3) nearest to the machine's with `axis` among its axes, and the free directions in it."""
    if kind in ("locked", "general"):
        return np.eye(3), ()
    if kind == "spherical":
        return np.eye(3), ("rx", "ry", "rz")
    i = int(np.argmax(np.abs(axis)))
    start, end = np.eye(3)[i], axis * _sign(axis)
    cross, cosine = np.cross(start, end), float(start @ end)
    k = np.array([[0, -cross[2], cross[1]], [cross[2], 0, -cross[0]], [-cross[1], cross[0], 0]])
    frame = np.eye(3) + k + k @ k / (1 + cosine)
    name = "xyz"[i]
    others = [other for other in "xyz" if other != name]
    names = {"hinge": [f"r{name}"], "slide": [name], "cylindrical": [name, f"r{name}"],
             "universal": [f"r{o}" for o in others], "planar": [*others, f"r{name}"]}[kind]
    return frame, tuple(names)


def _sign(axis: FloatArray) -> float:
    return -1.0 if axis[int(np.argmax(np.abs(axis)))] < 0 else 1.0


def _undetermined(kind: str, frame: FloatArray, axis: FloatArray) -> FloatArray:
    if kind in ("slide", "planar", "locked"):
        return np.eye(3)
    return (axis * _sign(axis))[None] if kind in ("hinge", "cylindrical") else np.zeros((0, 3))


def _slopes(fit: JointFit) -> tuple[FloatArray, FloatArray]:
    """Return the derivatives of (point, axis) to the parameters, each (3, n), by central differences."""
    n, step = len(fit.theta), 1e-6
    slopes = np.zeros((6, n))
    for i in range(n):
        shift = np.eye(n)[i] * step
        up, down = (np.concatenate(fit.chart.place(fit.theta + s)) for s in (shift, -shift))
        slopes[:, i] = (up - down) / (2 * step)
    return slopes[:3], slopes[3:]
