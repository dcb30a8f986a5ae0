"""AnimatedShapes: complex displacements of a scene's nodes, one set a mode, ready to be animated."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from toolpoint._check import Array, ComplexArray, FloatArray, ToolpointWarning, complexes, fail, floats, frozen
from toolpoint.vibration import Modes


@dataclass(frozen=True, eq=False)
class AnimatedShapes:
    r"""Shapes on the nodes of a scene: node j moves as :math:`x_j + s\,\mathrm{Re}(u_j e^{i \varphi})`.

    Parameters
    ----------
    frequency : (m,) floats
        Hz.
    damping_ratio : (m,) floats
        Ratio to critical.
    displacement : (m, n, 3) real or complex
        Translation of each node, any common scale; the page scales each mode to its own largest amplitude.
    labels : sequence of m str, optional
        A few words beside each mode.
    has_data : (n,) booleans, optional
        False for nodes without data: they are drawn grey and unmoved.
    notes : sequence of str
        Remarks shown under the view.

    >>> still_and_moving = np.array([[[0, 0, 0], [0, 0, 1e-3]]], complex)  # one mode of two nodes
    >>> AnimatedShapes(np.array([80.0]), np.array([0.02]), still_and_moving).displacement.shape
    (1, 2, 3)
    """

    frequency: FloatArray
    damping_ratio: FloatArray
    displacement: ComplexArray
    labels: tuple[str, ...] = ()
    has_data: NDArray[np.bool_] | None = None
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "frequency", floats("AnimatedShapes.frequency", np.atleast_1d(self.frequency)))
        if self.frequency.ndim != 1 or self.frequency.size == 0:
            fail("AnimatedShapes.frequency", f"shape {self.frequency.shape}", "must be (m,) with at least one mode",
                 remedy="for a batch of poses take one with modes.at_pose(i)")
        m = self.frequency.size
        put(self, "damping_ratio", floats("AnimatedShapes.damping_ratio", np.broadcast_to(self.damping_ratio, (m,))))
        put(self, "displacement", complexes("AnimatedShapes.displacement", self.displacement, (m, None, 3)))
        if self.displacement.ndim != 3:
            fail("AnimatedShapes.displacement", f"shape {self.displacement.shape}", f"must be ({m}, n, 3)")
        labels = tuple(str(label) for label in self.labels) or ("",) * m
        if len(labels) != m:
            fail("AnimatedShapes.labels", f"{len(labels)} labels", f"must be {m}", remedy="one for each mode")
        put(self, "labels", labels)
        n = self.displacement.shape[1]
        has_data = np.ones(n, bool) if self.has_data is None else np.array(self.has_data, bool)
        if has_data.shape != (n,):
            fail("AnimatedShapes.has_data", f"shape {has_data.shape}", f"must be ({n},)")
        put(self, "has_data", frozen(has_data))
        put(self, "notes", tuple(str(note) for note in self.notes))

    @classmethod
    def from_modes(
        cls, modes: Modes, points: Mapping[str | int, Any], labels: Iterable[str] = ()
    ) -> AnimatedShapes:
        """Return the shapes of modes (one pose) at points, in the order of `points` as `Scene.of_points` has it.

        At each point the translation u solves n_k . u = d_k for all its translational Dofs, direction n_k with sign or
        unit vector; in the least-squares sense where directions repeat, with the smallest u where they do not span
        space (a direction that was not measured stays unmoved and the notes say so). Points without data are marked
        unknown. Each mode is turned by the phase that makes its real part largest (`aligned`), as a mode's phase is
        free. Rotations and Dofs at points without coordinates are left out, the latter with a ToolpointWarning.
        """
        if modes.frequency.ndim > 1:
            fail("modes", f"{modes.frequency.shape[0]} poses", "must be one pose", remedy="use modes.at_pose(i) first")
        rows: dict[str | int, list[int]] = {point: [] for point in points}
        notes, unplaced_points = list(modes.notes), set()
        for i, dof in enumerate(modes.dofs):
            if dof.is_rotation:
                continue
            rows[dof.point].append(i) if dof.point in rows else unplaced_points.add(dof.point)
        if unplaced_points:
            text = (f"{len(unplaced_points)} points have data but no coordinates, for example "
                    f"{sorted(map(str, unplaced_points))[0]}")
            warnings.warn(text, ToolpointWarning, stacklevel=2)
            notes.append(text)
        directions = np.array([dof.unit[:3] for dof in modes.dofs])
        translations = [_translation(directions[i], modes.shape[i]) for i in rows.values()]
        notes += _gaps([np.linalg.matrix_rank(directions[i]) if i else 0 for i in rows.values()])
        shapes = cls(
            modes.frequency, modes.damping_ratio, np.stack(translations, axis=1), tuple(labels),
            np.array([bool(i) for i in rows.values()]), tuple(notes))
        return shapes.aligned()

    @property
    def count(self) -> int:
        """Number of modes."""
        return int(self.frequency.size)

    def aligned(self) -> AnimatedShapes:
        """Return each mode turned by exp(-i arg(sum u^2) / 2), so that its real part is as large as it can be."""
        turn = np.exp(-0.5j * np.angle((self.displacement**2).sum(axis=(1, 2))))
        return replace(self, displacement=self.displacement * turn[:, None, None])

    def at_phase(self, phase: float) -> FloatArray:
        """Return Re(u exp(i phase)), shape (m, n, 3); phase in rad."""
        return np.real(self.displacement * np.exp(1j * phase))

    def selected(self, modes: Iterable[int]) -> AnimatedShapes:
        """Return these modes, in the order asked for."""
        indices = list(modes)
        if not indices or any(not -self.count <= i < self.count for i in indices):
            fail("selected", f"modes {indices}", f"must be some within 0 .. {self.count - 1}")
        return replace(self, frequency=self.frequency[indices], damping_ratio=self.damping_ratio[indices],
                       displacement=self.displacement[indices], labels=tuple(self.labels[i] for i in indices))

    def __repr__(self) -> str:
        kind = "complex" if np.abs(self.displacement.imag).max(initial=0) > 0 else "real"
        return (f"AnimatedShapes({self.count} {kind} modes, {self.frequency.min():.4g}..{self.frequency.max():.4g} Hz, "
                f"{self.displacement.shape[1]} nodes)")


def _translation(directions: FloatArray, values: Array) -> Array:
    """Return the least-squares translation (m, 3) of a point from its measured directions (k, 3) and values (k, m)."""
    if directions.shape[0] == 0:
        return np.zeros((values.shape[-1], 3), values.dtype)
    return (np.linalg.pinv(directions, rcond=1e-6) @ values).T


def _gaps(rank: list[int]) -> list[str]:
    """Return remarks on points without data, or with data in some directions only; rank : of each point's directions."""
    missing_count, partial_count = sum(r == 0 for r in rank), sum(0 < r < 3 for r in rank)
    notes = []
    if missing_count:
        notes.append(f"{missing_count} of {len(rank)} points have no data: drawn grey and unmoved.")
    if partial_count:
        notes.append(f"{partial_count} of {len(rank)} points have data in one or two directions only: no motion is drawn "
                     "in the others.")
    return notes
