r"""Linear joint: each of six directions is locked, elastic or free; or full 6x6 stiffness and damping matrices."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import LEFT_OUT, FloatArray, fail, floats, frozen, one_of, symmetric
from toolpoint._notebook import NotebookText
from toolpoint.joints.travel import AxialTravel

DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")
DIRECTION_STATES = ("locked", "elastic", "free")


@dataclass(frozen=True, eq=False)
class LinearJoint(NotebookText):
    r"""Stiffness and damping of an interface, in its own frame, for small relative motion (v, w) of child to parent.

    Parameters
    ----------
    states : 6 str
        ``locked``, ``elastic`` or ``free`` for x, y, z, rx, ry, rz.
    stiffness : (6, 6) floats, optional
        N/m, N, N m/rad; rows and columns of directions that are not elastic must be zero.
    damping : (6, 6) floats, optional
        N s/m and so on; rows and columns of locked directions must be zero.
    structural_damping : (6, 6) floats, optional
        Imaginary part of the complex stiffness, e.g. loss factor times stiffness.
    twists : (6, 6) floats, optional
        Column i is the unit motion (v, w) of coordinate i in the joint's frame; the six directions where left out.
    travel : AxialTravel, optional
        Stiffness that changes as an axis moves the joint; `stiffness` is that of the described pose.

    Raises
    ------
    ToolpointError
        For a matrix that is not symmetric and positive semidefinite, or has values in directions without them.

    Examples
    --------
    >>> from toolpoint.joints import LinearJoint
    >>> joint = LinearJoint(("free", *5 * ("locked",)))
    >>> joint.freedoms, joint.basis.shape
    ((0,), (6, 1))
    """

    states: tuple[str, ...]
    stiffness: FloatArray = LEFT_OUT
    damping: FloatArray = LEFT_OUT
    structural_damping: FloatArray = LEFT_OUT
    twists: FloatArray = LEFT_OUT
    travel: AxialTravel | None = None

    def __post_init__(self) -> None:
        set_field = object.__setattr__
        states = tuple(one_of("LinearJoint.states", state, DIRECTION_STATES) for state in self.states)
        if len(states) != 6:
            fail("LinearJoint.states", f"{len(states)} states", "must be 6")
        set_field(self, "states", states)
        zero = np.zeros((6, 6))
        for name, allowed in (("stiffness", ("elastic",)), ("damping", ("elastic", "free")),
                              ("structural_damping", ("elastic",))):
            value = getattr(self, name)
            matrix = symmetric(f"LinearJoint.{name}", floats(f"LinearJoint.{name}", zero if value is None else value, (6, 6)))
            excluded = [direction for direction in range(6) if states[direction] not in allowed]
            if np.any(matrix[excluded]):
                direction = excluded[int(np.argmax(np.abs(matrix[excluded]).max(axis=1) > 0))]
                fail(f"LinearJoint.{name}", f"a value in direction {DIRECTIONS[direction]}, which is {states[direction]}",
                     f"must be zero there", remedy=f"make the direction {' or '.join(allowed)}")  # noqa: F541
            # Rounding of a matrix that was moved from another frame leaves eigenvalues of either sign about 1e-16 of the
            # largest.
            if matrix.size and np.linalg.eigvalsh(matrix).min() < -1e-9 * max(np.abs(matrix).max(), 1e-300):
                fail(f"LinearJoint.{name}", "a negative eigenvalue", "must be positive semidefinite")
            set_field(self, name, matrix)
        set_field(self, "twists", floats("LinearJoint.twists", np.eye(6) if self.twists is None else self.twists, (6, 6)))

    @cached_property
    def is_of_directions(self) -> bool:
        """Whether its coordinates are the directions of its frame, not screws."""
        return bool((self.twists == np.eye(6)).all())

    @cached_property
    def basis(self) -> FloatArray:
        """Motions (6, f) of the coordinates that are not locked, in the joint's frame."""
        return frozen(self.twists[:, list(self.freedoms)])

    @cached_property
    def freedoms(self) -> tuple[int, ...]:
        """Indices of the directions (or screws) that are not locked."""
        return tuple(i for i, state in enumerate(self.states) if state != "locked")

    def __repr__(self) -> str:
        parts = []
        for i, state in enumerate(self.states):
            name = DIRECTIONS[i] if self.is_of_directions else f"s{i + 1}"
            if state == "elastic":
                parts.append(f"{name} {self.stiffness[i, i]:.4g}")
            elif state == "free":
                parts.append(f"{name} free")
        return f"LinearJoint({', '.join(parts) or 'all locked'})"


def linear(
    stiffness: Mapping[str, float] | ArrayLike | None = None,
    damping: Mapping[str, float] | ArrayLike | None = None,
    loss_factor: Mapping[str, float] | float = 0.0,
    *, free: Iterable[str] = (),
) -> LinearJoint:
    """Return a joint from values per direction; a direction that is neither elastic nor free is locked.

    Parameters
    ----------
    stiffness : mapping of direction to N/m or N m/rad, or a (6, 6) matrix
        The directions named are elastic; with a matrix all those with a row that is not zero.
    damping : mapping or (6, 6) matrix, optional
        N s/m or N m s/rad.
    loss_factor : float or mapping
        Imaginary part over real part of the stiffness.
    free : directions
        Directions without stiffness.

    Raises
    ------
    ToolpointError
        For a direction both elastic and free, damping of a locked direction, or a negative loss factor.

    Examples
    --------
    >>> from toolpoint.joints import linear
    >>> linear({"y": 1.2e8, "z": 1.5e8}, {"y": 4e3}, free=["x"])
    LinearJoint(x free, y 1.2e+08, z 1.5e+08)
    """
    k, elastic_directions = _matrix("stiffness", stiffness)
    free_directions = {DIRECTIONS.index(one_of("free", name, DIRECTIONS)) for name in free}
    conflicts = elastic_directions & free_directions
    if conflicts:
        fail("free", f"{DIRECTIONS[min(conflicts)]} is also elastic", "a direction is one or the other")
    states = tuple("elastic" if i in elastic_directions else "free" if i in free_directions else "locked" for i in range(6))
    c, damped_directions = _matrix("damping", damping)
    locked_directions = [DIRECTIONS[i] for i in sorted(damped_directions) if states[i] == "locked"]
    if locked_directions:
        fail("damping", f"direction {locked_directions[0]} is locked", "only elastic or free directions can be damped",
             remedy=f"give stiffness.{locked_directions[0]} or list {locked_directions[0]} under free")
    eta = np.zeros(6)
    if isinstance(loss_factor, Mapping):
        for name, value in loss_factor.items():
            eta[DIRECTIONS.index(one_of("loss_factor", name, DIRECTIONS))] = value
    else:
        eta[:] = loss_factor
    if eta.min() < 0:
        fail("loss_factor", f"{eta.min():g}", "must not be negative")
    # The loss matrix stays symmetric: eta_ij = sqrt(eta_i eta_j).
    root_eta = np.sqrt(eta)
    return LinearJoint(states, k, c, root_eta[:, None] * k * root_eta)


def screws(twists: ArrayLike, stiffness: ArrayLike, damping: ArrayLike | None = None, *,
           loss_factor: float = 0.0) -> LinearJoint:
    """Return a joint that is free along any twists of its frame and nothing else.

    Parameters
    ----------
    twists : (f, 6) floats, f from 1 to 6
        Rows (v, w) about the frame's origin, in its axes, m/rad beside 1; independent of each other.
    stiffness : (f, f) floats
        Over the coordinates of these twists; positive definite.
    damping : (f, f) floats, optional
    loss_factor : float

    Raises
    ------
    ToolpointError
        For dependent twists, a stiffness that is not positive definite, or a negative loss factor.

    Examples
    --------
    >>> from toolpoint.joints import screws
    >>> screws([[0, 0, 0.01, 0, 0, 1]], [[5e5]])  # a screw of 10 mm/rad about z
    LinearJoint(s1 5e+05)
    """
    rows = floats("screws", twists, (None, 6))
    n_twists = len(rows)
    if not 1 <= n_twists <= 6 or np.linalg.matrix_rank(rows, tol=1e-9) < n_twists:
        fail("screws", f"{n_twists} rows of rank {np.linalg.matrix_rank(rows, tol=1e-9)}",
             "must be one to six independent twists",
             remedy="leave out what others hold")
    if loss_factor < 0:
        fail("loss_factor", f"{loss_factor:g}", "must not be negative")
    matrix = symmetric("stiffness_matrix", floats("stiffness_matrix", stiffness, (n_twists, n_twists)))
    if np.linalg.eigvalsh(matrix)[0] <= 0:
        fail("stiffness_matrix", f"eigenvalue {np.linalg.eigvalsh(matrix)[0]:g}", "must be positive definite over the screws")
    k, c, basis = np.zeros((6, 6)), np.zeros((6, 6)), np.zeros((6, 6))
    k[:n_twists, :n_twists] = matrix
    c[:n_twists, :n_twists] = 0.0 if damping is None else floats("damping_matrix", damping, (n_twists, n_twists))
    basis[:, :n_twists] = rows.T
    return LinearJoint(("elastic",) * n_twists + ("locked",) * (6 - n_twists), k, c, loss_factor * k, basis)


def _matrix(name: str, value: Mapping[str, float] | ArrayLike | None) -> tuple[FloatArray, set[int]]:
    """Return values per direction, or a matrix, as a matrix (6, 6) and the directions that it names."""
    matrix: FloatArray = np.zeros((6, 6))
    if value is None:
        return matrix, set()
    if not isinstance(value, Mapping):
        matrix = floats(name, value, (6, 6))
        return matrix, {i for i in range(6) if np.any(matrix[i])}
    directions = set()
    for direction, number in value.items():
        i = DIRECTIONS.index(one_of(name, direction, DIRECTIONS))
        if not np.isfinite(number) or number < 0 or (name == "stiffness" and number == 0):
            fail(f"{name}.{direction}", f"{number!r}", "must be finite and above zero")
        matrix[i, i] = number
        directions.add(i)
    return matrix, directions
