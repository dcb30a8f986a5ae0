r"""The forms in which a joint enters the fit of a whole machine, each a map from a few numbers (zero at the start) to a joint.

- diagonal: directions of one frame with a stiffness each; the frame moves also along what only the stiffness tells: the
  elastic centre of a planar joint, the principal directions of a spherical one;
- full: directions of one frame with a symmetric matrix over them;
- free: any subspace of twists with a symmetric matrix over it (screws, skew axes).

Numbers: small motions of the frame in itself (m, rad) or of the subspace, logarithms of the stiffnesses or a symmetric change
:math:`K = C e^S C^T` of the matrix at the start, the loss factor, and the relaxation time (s) where viscous damping is
asked.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import optimize

from toolpoint._check import FloatArray
from toolpoint.joint_identification.joints.kinds import effective_moves, inner_moves, unit_twists
from toolpoint.joint_identification.machine.rigid_machine import ElasticJoint
from toolpoint.spatial import transform as tf

# Prior standard deviations that only keep a fit regular: of a frame's motion (m, rad), of a stiffness (factor e^4), of a loss
# factor.
_PLACE_DEVIATION, _LOG_STIFFNESS_DEVIATION, _LOSS_DEVIATION = 3.0, 4.0, 0.5


@dataclass(frozen=True, eq=False)
class JointForm:
    """A form at its start: `start` joint (with its twists in its frame), `ways` of the frame (empty: any subspace), whether
    its stiffness is `diagonal`, the `length` (m) by which rotations count where the subspace moves, the prior width (s) of a
    relaxation time (`viscous`, 0: none is asked), and whether it has a loss factor (`lossy`)."""

    start: ElasticJoint
    ways: tuple[str, ...]
    diagonal: bool
    length: float = 1.0
    viscous: float = 0.0
    lossy: bool = True

    @property
    def frame_motions(self) -> FloatArray:
        """Twists (6, n) of the frame in itself that are numbers of this form."""
        return effective_moves(self.ways, self.diagonal) if self.ways else np.zeros((6, 0))

    @property
    def sizes(self) -> tuple[int, int, int]:
        """Numbers of the place, of the stiffness, and of the damping."""
        f = self.start.twists.shape[1]
        place = self.frame_motions.shape[1] if self.ways else f * (6 - f)
        return place, f if self.diagonal else f * (f + 1) // 2, int(self.lossy) + int(self.viscous > 0)

    @property
    def count(self) -> int:
        """Number of numbers."""
        return sum(self.sizes)

    @property
    def deviations(self) -> FloatArray:
        """Prior standard deviations of the numbers."""
        place, stiff, _ = self.sizes
        damping = [_LOSS_DEVIATION] * self.lossy + [self.viscous] * (self.viscous > 0)
        return np.array([_PLACE_DEVIATION] * place + [_LOG_STIFFNESS_DEVIATION] * stiff + damping)

    @property
    def lower(self) -> FloatArray:
        """Lower bounds of the numbers: no joint gives energy off."""
        place, stiff, _ = self.sizes
        damping = [-self.start.loss_factor] * self.lossy + [-self.start.relaxation] * (self.viscous > 0)
        return np.array([-np.inf] * (place + stiff) + damping)

    def joint(self, x: FloatArray) -> ElasticJoint:
        """Return the joint of these numbers."""
        place, stiff, _ = self.sizes
        start = self.start
        frame, twists = start.frame, start.twists
        if self.ways and place:
            frame = frame @ tf.exponential(self.frame_motions @ x[:place])
        elif place:
            twists = self._subspace(x[:place])
        y = x[place:place + stiff]
        stiffness = np.diag(np.diag(start.stiffness) * np.exp(np.clip(y, -30, 30))) if self.diagonal else self._matrix(y)
        damping = x[place + stiff:]
        return ElasticJoint(frame, twists, stiffness, start.loss_factor + (float(damping[0]) if self.lossy else 0.0),
                            start.relaxation + (float(damping[-1]) if self.viscous else 0.0))

    def _subspace(self, x: FloatArray) -> FloatArray:
        """Return the twists of a moved subspace."""
        scale = np.array([1.0] * 3 + [self.length] * 3)[:, None]
        local = self.start.twists * scale
        outside = np.linalg.svd(local, full_matrices=True)[0][:, local.shape[1]:]
        return np.asarray((local + outside @ x.reshape(outside.shape[1], -1)) / scale)

    def _matrix(self, y: FloatArray) -> FloatArray:
        """Return the stiffness K = C e^S C^T of a symmetric change S."""
        lower = np.linalg.cholesky(self.start.stiffness)
        change = np.zeros_like(lower)
        rows, columns = np.triu_indices(len(lower))
        change[rows, columns] = y
        change[columns, rows] = y
        # The exponential of a symmetric matrix: positive definite whatever the numbers.
        values, vectors = np.linalg.eigh(change)
        matrix = lower @ (vectors * np.exp(np.clip(values, -30, 30))) @ vectors.T @ lower.T
        return np.asarray((matrix + matrix.T) / 2)

    def centred(self, x: FloatArray) -> JointForm:
        """Return the same form with these numbers as its start."""
        return replace(self, start=self.joint(x))


def diagonal_form(frame: FloatArray, ways: tuple[str, ...], stiffness: FloatArray) -> JointForm:
    """Return the diagonal form nearest to a stiffness matrix (f, f) over the directions of a frame."""
    moved, values = diagonalise(frame, ways, stiffness)
    return JointForm(ElasticJoint(moved, unit_twists(ways), np.diag(values)), ways, True)


def diagonalise(frame: FloatArray, ways: tuple[str, ...], stiffness: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the frame, moved within what the free motions leave open, over whose directions a stiffness is most diagonal."""
    motions, units = inner_moves(ways), unit_twists(ways)
    f = len(ways)
    if not motions.shape[1] or np.abs(stiffness - np.diag(np.diag(stiffness))).max() == 0:
        return frame, np.diag(stiffness)
    upper = np.triu_indices(f, 1)

    def matrix_at(x: FloatArray) -> FloatArray:
        # The new directions in terms of the old ones: their span is the same.
        directions = (tf.adjoint(tf.exponential(motions @ x)) @ units)[units.any(axis=1)]
        return np.asarray(directions.T @ stiffness @ directions)

    def coupling(x: FloatArray) -> FloatArray:
        matrix = matrix_at(x)
        size = np.sqrt(np.diag(matrix))
        return np.asarray((matrix / np.outer(size, size))[upper])

    best = optimize.least_squares(coupling, np.zeros(motions.shape[1]))
    if best.cost > 1e-3:
        rng = np.random.default_rng(0)
        # The coupling has several minima over turns of the frame: the best of a few random starts counts.
        restarts = [optimize.least_squares(coupling, rng.uniform(-0.7, 0.7, motions.shape[1])) for _ in range(4)]
        best = min([best, *restarts], key=lambda result: float(result.cost))
    return frame @ tf.exponential(motions @ best.x), np.diag(matrix_at(best.x))
