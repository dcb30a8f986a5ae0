r"""Mode coupling without regeneration: stability of a cut whose force follows the present vibration alone (robots)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, count, fail, positive
from toolpoint.cutting.cut.modal_state import ModalState, modal_plane
from toolpoint.cutting.cut.problem import MillingProblem, TurningProblem


@dataclass(frozen=True)
class ModeCoupling:
    """Limit of mode coupling.

    Parameters
    ----------
    depth : float
        Least depth of instability, m; infinite where none lies below the largest looked at.
    frequency : float
        Frequency of the unstable vibration, Hz (0: static divergence); NaN where stable.
    """

    depth: float
    frequency: float


def mode_coupling(problem: MillingProblem | TurningProblem, depth_max: float = 0.05, levels: int = 200) -> ModeCoupling:
    r"""Return the least depth at which :math:`F = -w \bar A r` (no delay) makes the structure unstable.

    With stiff tools on soft structures chatter near the structure's own frequencies does not depend on the spindle
    speed: two modes of close stiffness are coupled by the unsymmetric matrix of the cut, :math:`\det(I + w \bar A
    G(s)) = 0` with Re s > 0. Of a milling problem the matrix is the mean over rotation; of a turning problem force and chip
    thickness have their given directions f and n, :math:`1 + w K_f\,n^T G(s) f = 0`.

    Source: Gasparetto, J. Dynamic Systems Measurement Control 123 (2001) 191; Pan, Zhang, Zhu, Wang, J. Materials
    Processing Technology 173 (2006) 301.

    Parameters
    ----------
    problem : MillingProblem or TurningProblem
        Modal dynamics; without process damping.
    depth_max : float
        m.
    levels : int
        Depths at which the roots are computed before bisection.
    """
    if isinstance(problem, TurningProblem) and problem.process_damping > 0:
        fail("problem", "process damping", "mode coupling is looked for without it", remedy="leave the process damping out")
    matrix = np.diag([problem.stiffness, 0.0]) if isinstance(problem, TurningProblem) else problem.mean_matrix
    system = ModalState(modal_plane(problem.plane))
    poles, left, right = system.poles, system.left, system.right
    all_poles = np.concatenate([poles, poles.conj()])
    output, drive = np.concatenate([left, left.conj()], axis=1), np.concatenate([right, right.conj()])

    def roots(depth: float) -> FloatArray:
        return np.linalg.eigvals(np.diag(all_poles) - depth * drive @ matrix @ output)

    depth_limit = positive("depth_max", depth_max, 10.0)
    grid = depth_limit * np.arange(1, count("levels", levels, 4) + 1) / levels
    stable_depth = 0.0
    for w in grid:
        if roots(w).real.max() > 0:
            break
        stable_depth = w
    else:
        return ModeCoupling(float("inf"), float("nan"))
    unstable_depth = float(w)
    for _ in range(80):
        middle = (stable_depth + unstable_depth) / 2
        stable_depth, unstable_depth = (stable_depth, middle) if roots(middle).real.max() > 0 else (middle, unstable_depth)
    s = roots(unstable_depth)
    return ModeCoupling(float(unstable_depth), float(np.abs(s[np.argmax(s.real)].imag)) / (2 * np.pi))
