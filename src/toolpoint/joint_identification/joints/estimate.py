"""JointEstimate: position, freedoms, directions and kind of one joint as plain data, with uncertainty and doubts."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations, product
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from toolpoint._check import LEFT_OUT, FloatArray
from toolpoint._doubt import Doubt
from toolpoint._notebook import NotebookText
from toolpoint._rounding import NORMAL_QUANTILE_95, with_uncertainty
from toolpoint.joint_identification.joints.joint_fit import JointFit
from toolpoint.joint_identification.joints.kinds import DIRECTIONS, idle_translations, turning_axes, unit_twists
from toolpoint.joint_identification.motion.measured import about
from toolpoint.joint_identification.motion.relative_motion import RelativeMotion
from toolpoint.spatial import transform as tf

_UNITS = {**dict.fromkeys(("x", "y", "z"), "N/m"), **dict.fromkeys(("rx", "ry", "rz"), "N m/rad")}


@dataclass(frozen=True, eq=False)
class JointEstimate(NotebookText):
    """One joint.

    Parameters
    ----------
    parent, child : str
    kind : str
        One of `kinds.WAYS`, ``screw`` or ``general``.
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
    frame_covariance : (6, 6) floats
        Of a small motion (v in m, w in rad) of the frame in itself; zero along motions that neither kind nor stiffness tells.
    loss_factor, loss_factor_deviation : float
        Of the joint, with its standard deviation; None where masses are not known.
    relaxation, relaxation_deviation : float
        Viscous damping over stiffness, s; zero where the data ask for none.
    probability : float
        p-value of the misfit.
    alternatives : tuple of str
        Other kinds with as many freedoms that the data do not refuse.
    doubts : tuple of str
        Reasons against the estimate; empty for a joint that the data establish.

    Examples
    --------
    Runs in ``examples/joint_between_two_plates.py``.
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
    doubts: tuple[Doubt, ...] = ()
    stiffness_matrix: FloatArray | None = None
    stiffness_matrix_deviation: FloatArray | None = None
    frame_covariance: FloatArray = LEFT_OUT
    loss_factor: float | None = None
    loss_factor_deviation: float = 0.0
    relaxation: float = 0.0
    relaxation_deviation: float = 0.0

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
        return NORMAL_QUANTILE_95 * np.sqrt(np.clip(np.diag(self.position_covariance), 0, None))

    @property
    def position_text(self) -> str:
        """The position in mm with its 95 % half widths; ``free`` where the kind leaves a coordinate open."""
        words = []
        for k, (value, half_width) in enumerate(zip(1e3 * self.position, 1e3 * self.position_interval, strict=True)):
            if np.linalg.norm(self.undetermined[:, k]) > 0.9:
                words.append(f"{value:.0f} (free)")
            else:
                decimals = 1 if half_width <= 0 else int(min(max(1 - np.floor(np.log10(half_width)), 0), 4))
                words.append(f"{value:.{decimals}f} ± {half_width:.{decimals}f}")
        return ", ".join(words)

    @property
    def axis_deviation(self) -> float:
        """Standard deviation of the axis' direction in its less certain way, rad."""
        return float(np.sqrt(max(np.linalg.eigvalsh(self.axis_covariance)[-1], 0.0)))

    @property
    def stiffness_interval(self) -> FloatArray | None:
        """Half width of the 95 % interval of each stiffness."""
        return None if self.stiffness_deviation is None else NORMAL_QUANTILE_95 * self.stiffness_deviation

    @property
    def certain(self) -> bool:
        """Whether there is no doubt about the joint."""
        return not self.doubts

    @property
    def status(self) -> str:
        """Summary: established, or the doubts."""
        return "established" if self.certain else "doubtful: " + "; ".join(self.doubts)

    @property
    def pitches(self) -> FloatArray:
        """Pitch of every free twist, m/rad: 0 for a rotation, infinite for a translation, shape (f,)."""
        v, w = self.screws[:3], self.screws[3:]
        rotation_square = (w**2).sum(axis=0)
        with np.errstate(divide="ignore", invalid="ignore"):
            pitch = (v * w).sum(axis=0) / rotation_square
        # A twist with less rotation than rounding leaves is a translation: its pitch is infinite, not some large number.
        return np.where(rotation_square > 1e-18 * np.maximum((v**2).sum(axis=0), 1e-300), pitch, np.inf)

    @property
    def free_text(self) -> str:
        """Free directions with the frame where it is oblique, or screws with their axes and pitches."""
        if not self.freedoms and self.screws.shape[1]:
            parts = []
            for (v, w), pitch in zip(((s[:3], s[3:]) for s in self.screws.T), self.pitches, strict=True):
                axis = v / np.linalg.norm(v) if np.isinf(pitch) else w / np.linalg.norm(w)
                how = "slide" if np.isinf(pitch) else "turn" if abs(pitch) < 1e-6 else f"screw {1e3 * pitch:.3g} mm/rad"
                parts.append(f"{how} ({axis[0]:.3f}, {axis[1]:.3f}, {axis[2]:.3f})")
            return "; ".join(parts)
        text = " ".join(self.freedoms)
        letters = sorted({way[-1] for way in self.freedoms})
        if np.abs(self.frame - np.eye(3)).max() < 0.01 or not letters:
            return text
        axes = [f"{letter} = ({', '.join(f'{v:.3f}' for v in self.frame[:, 'xyz'.index(letter)])})" for letter in letters]
        return f"{text}, {', '.join(axes)}"

    @property
    def damping_text(self) -> str:
        """Loss factor, and relaxation time where there is one, with their 95 % half widths."""
        if self.loss_factor is None or not self.screws.shape[1]:
            return ""
        parts = []
        if self.loss_factor_deviation or not self.relaxation:
            parts.append(with_uncertainty(100 * self.loss_factor, 100 * NORMAL_QUANTILE_95 * self.loss_factor_deviation, "%"))
        if self.relaxation:
            parts.append(with_uncertainty(1e6 * self.relaxation, 1e6 * NORMAL_QUANTILE_95 * self.relaxation_deviation, "µs"))
        return ", ".join(parts)

    @property
    def stiffness_text(self) -> str:
        """Stiffness of every freedom with its 95 % half width; of a matrix its diagonal."""
        if self.stiffness is not None and self.stiffness_interval is not None:
            names = self.freedoms or tuple(f"s{i + 1}" for i in range(len(self.stiffness)))
            values = zip(names, self.stiffness, self.stiffness_interval, strict=True)
        elif self.stiffness_matrix is not None and self.stiffness_matrix_deviation is not None:
            names = self.freedoms or tuple(f"s{i + 1}" for i in range(len(self.stiffness_matrix)))
            values = zip(names, np.diag(self.stiffness_matrix), NORMAL_QUANTILE_95 * np.diag(self.stiffness_matrix_deviation),
                         strict=True)
        else:
            return ""
        return ", ".join(f"{name} {with_uncertainty(k, half, _UNITS.get(name, ''))}" for name, k, half in values)

    def as_dict(self) -> dict[str, Any]:
        """Return plain data (lists, numbers, names; SI, rad): all that table and page show, with covariances and doubts."""
        result: dict[str, Any] = {
            "parent": self.parent, "child": self.child, "kind": self.kind, "at": self.position.tolist(),
            "at_covariance": self.position_covariance.tolist(), "at_undetermined": self.undetermined.tolist(),
            "rotation_zyx": self.rotation.tolist(), "freedoms": list(self.freedoms), "directions": self.directions.tolist(),
            "axis": self.axis.tolist(), "axis_deviation": self.axis_deviation, "screws": self.screws.T.tolist(),
            "pitches": [None if np.isinf(p) else float(p) for p in self.pitches], "alternatives": list(self.alternatives),
            "probability": self.probability, "status": self.status, "doubts": list(self.doubts)}
        if self.frame_covariance is not None:
            result["frame_covariance"] = self.frame_covariance.tolist()
        if self.stiffness is not None and self.freedoms:
            result["stiffness"] = dict(zip(self.freedoms, self.stiffness.tolist(), strict=True))
        if self.stiffness_interval is not None and self.freedoms:
            result["stiffness_interval"] = dict(zip(self.freedoms, self.stiffness_interval.tolist(), strict=True))
        if self.stiffness_matrix is not None and self.stiffness_matrix_deviation is not None:
            result |= {"stiffness_matrix": self.stiffness_matrix.tolist(),
                       "stiffness_matrix_deviation": self.stiffness_matrix_deviation.tolist()}
        if self.loss_factor is not None:
            result |= {"loss_factor": self.loss_factor, "loss_factor_interval": NORMAL_QUANTILE_95 * self.loss_factor_deviation,
                       "relaxation_s": self.relaxation, "relaxation_interval_s": NORMAL_QUANTILE_95 * self.relaxation_deviation}
        return result

    def __repr__(self) -> str:
        position = self.position_text
        free = ", ".join(self.freedoms) or f"{self.screws.shape[1]} screws"
        return f"JointEstimate({self.child!r} on {self.parent!r}: {self.kind}, free {free}, at {position} mm, {self.status})"


def estimate_joint(motion: RelativeMotion, fits: list[JointFit], doubts: tuple[Doubt, ...]) -> JointEstimate:
    """Return the joint of the best fit in machine coordinates, with the uncertainty of its parameters carried over."""
    fit = fits[0]
    place, spread = _frame_covariance(motion, fit)
    frame, names, rotation = joint_frame(place[:3, :3], fit.chart.ways)
    axis = axis_of(place[:3, :3], fit.chart.ways, fit.kind)
    axis_covariance = place[:3, :3] @ spread[3:, 3:] @ place[:3, :3].T
    across = _skew(axis)
    rotations = np.kron(np.eye(2), rotation)
    return JointEstimate(
        motion.parent, motion.child, fit.kind, place[:3, 3], place[:3, :3] @ spread[:3, :3] @ place[:3, :3].T,
        (place[:3, :3] @ idle_translations(fit.chart.ways, False)).T if _is_placed(fit) else np.zeros((0, 3)), axis,
        across @ axis_covariance @ across.T,
        frame, names, free_twists(motion, fit, frame, names=names), fit.probability, tuple(other.kind for other in fits[1:]),
        doubts=doubts, frame_covariance=rotations.T @ spread @ rotations)


def _is_placed(fit: JointFit) -> bool:
    """Whether the fit determines a position."""
    return bool(fit.chart.ways) or fit.kind == "locked"


def _frame_covariance(motion: RelativeMotion, fit: JointFit) -> tuple[FloatArray, FloatArray]:
    """Return the joint's frame (4, 4) in the machine frame, m, and the covariance (6, 6) of its small motion in itself."""
    place = fit.chart.frame(fit.theta).copy()
    slope = np.zeros((6, len(fit.theta)))
    # Coordinates of the chart are of order one (lengths in units of `motion.size`), so a forward step of 1e-6 gives slopes
    # to 1e-6.
    for i, step in enumerate(1e-6 * np.eye(len(fit.theta))):
        slope[:, i] = tf.logarithm(tf.inverse(place) @ fit.chart.frame(fit.theta + step)) / 1e-6
    slope[:3] *= motion.size
    place[:3, 3] = motion.centre + motion.size * place[:3, 3]
    return place, slope @ fit.covariance @ slope.T


def axis_of(axes: FloatArray, ways: tuple[str, ...], kind: str) -> FloatArray:
    """Return the direction that the motions determine: that which the frame may turn about, or the only rotation's."""
    free, turns = turning_axes(ways), [way for way in ways if len(way) == 2]
    if kind == "screw":
        axis = axes[:, 0]
    elif ways and free.shape[1] == 1:
        axis = axes @ free[:, 0]
    elif len(turns) == 1:
        axis = axes[:, "xyz".index(turns[0][1])]
    else:
        return np.zeros(3)
    # A line has no sense: its largest component is made positive, so that axes of two fits can be compared.
    return np.asarray(axis * (-1.0 if axis[int(np.argmax(np.abs(axis)))] < 0 else 1.0))


def free_twists(motion: RelativeMotion, fit: JointFit, frame: FloatArray, *, names: tuple[str, ...]) -> FloatArray:
    """Return the free twists (6, f) about the origin: along and about the joint frame's axes, or a general basis."""
    if not names and fit.chart.freedoms:
        basis = about(motion.centre, motion.size) @ fit.chart.basis(fit.theta)
        return np.asarray(basis / np.linalg.norm(basis[3:]) if fit.kind == "screw" else np.linalg.qr(basis)[0])
    point = motion.centre + motion.size * fit.chart.frame(fit.theta)[:3, 3]
    return np.asarray(tf.adjoint(tf.transform(frame, point)) @ unit_twists(names))


def joint_frame(axes: FloatArray, ways: tuple[str, ...]) -> tuple[FloatArray, tuple[str, ...], FloatArray]:
    """Return the frame (3, 3) nearest to the machine's with the same free directions, their names in it, and the rotation.

    The axes are renamed, and turned about directions that the motions leave open.
    """
    if not ways:
        return np.eye(3), (), axes.T
    best, largest_trace = (axes, ways), -np.inf
    for order in _axis_renamings():
        names = _rename_directions(ways, order)
        aligned = _align_axes(axes @ order, turning_axes(names))
        # Renamings that lie equally near differ by rounding: the margin lets the first one win on every machine.
        if np.trace(aligned) > largest_trace + 1e-9:
            best, largest_trace = (aligned, names), float(np.trace(aligned))
    return best[0], best[1], axes.T @ best[0]


def _axis_renamings() -> list[FloatArray]:
    """Return the 24 rotations that turn axes into axes."""
    signed = [np.array(signs) * np.eye(3)[:, list(order)] for order in permutations(range(3))
              for signs in product((1.0, -1.0), repeat=3)]
    return [order for order in signed if np.linalg.det(order) > 0]


def _rename_directions(ways: tuple[str, ...], order: FloatArray) -> tuple[str, ...]:
    """Return the directions in axes that are the columns of `order` in the old ones."""
    names = {way[:-1] + "xyz"[int(np.argmax(np.abs(order["xyz".index(way[-1])])))] for way in ways}
    return tuple(name for name in DIRECTIONS if name in names)


def _align_axes(axes: FloatArray, free: FloatArray) -> FloatArray:
    """Return the axes turned about their free directions (3, n) so that they are nearest to the machine's."""
    if free.shape[1] == 3:
        return np.eye(3)
    if free.shape[1] != 1:
        return axes
    a = free[:, 0]
    cross = _skew(a)
    # trace(R exp(a t)) = const + c cos t + s sin t.
    c, s = float(np.trace(axes @ (np.eye(3) - np.outer(a, a)))), float(np.trace(axes @ cross))
    angle = np.arctan2(s, c)
    return np.asarray(axes @ (np.outer(a, a) + np.cos(angle) * (np.eye(3) - np.outer(a, a)) + np.sin(angle) * cross))


def _skew(v: FloatArray) -> FloatArray:
    """Return the cross-product matrix."""
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
