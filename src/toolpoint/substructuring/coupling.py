r"""Coupling of equations of motion: primal (one set of coordinates) and dual (forces between parts as unknowns).

With compatibility :math:`B u = 0`, u the labelled outputs: primal :math:`M = N^T M N`, N a basis of the null space of
B; dual :math:`Z q + L^T B^T \lambda = f,\; B L q = -C \lambda`, C the compliance of the links. Source: de Klerk, Rixen,
Voormeeren, AIAA J. 46 (2008).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import null_space

from toolpoint._check import ComplexArray, FloatArray, fail, floats, nonnegative
from toolpoint.substructuring.parts import Link, link_rows, stack_systems
from toolpoint.vibration import Dof, Frf, SecondOrderSystem

LINK_RANK_TOLERANCE = 1e-10  # smallest singular value of links of unit length that counts as one more constraint


def couple(parts: Mapping[str, SecondOrderSystem], links: Iterable[Link]) -> SecondOrderSystem:
    """Join parts rigidly at links, in coordinates that satisfy these (primal assembly, M = N^T M N).

    Parameters
    ----------
    parts : mapping of name to SecondOrderSystem
        Of one pose. The labels of the whole are ``part.point:direction``.
    links : pairs of labels of outputs that move together

    Raises
    ------
    ToolpointError
        For unknown labels, links that repeat each other, or links that leave no motion.

    Examples
    --------
    Two free masses joined rigidly are one free mass:

    >>> import numpy as np
    >>> from toolpoint.vibration import SecondOrderSystem
    >>> def mass(m, point):
    ...     return SecondOrderSystem([[m]], [[0.0]], outputs=[f"{point}:+x"], inputs=[f"{point}:+x"])
    >>> joined = couple({"left": mass(1.0, "a"), "right": mass(2.0, "b")}, [("left.a:+x", "right.b:+x")])
    >>> [round(float(m), 12) for m in 1 / (joined.output_map @ np.linalg.inv(joined.mass) @ joined.input_map)[0]]
    [3.0, 3.0]
    """
    uncoupled = stack_systems(parts)
    constraint = _constraint(uncoupled, list(links))
    # Rows of unit length: the tolerance is relative to each link, in metres or radians.
    basis = null_space(constraint / np.linalg.norm(constraint, axis=1, keepdims=True), rcond=LINK_RANK_TOLERANCE)
    if basis.shape[1] == 0:
        fail("links", f"{len(constraint)} links", "must leave a motion", remedy="give parts more coordinates")

    def projected(matrix: FloatArray | None) -> FloatArray | None:
        return None if matrix is None else basis.T @ matrix @ basis

    mass, stiffness = projected(uncoupled.mass), projected(uncoupled.stiffness)
    assert mass is not None and stiffness is not None
    return replace(uncoupled, mass=(mass + mass.T) / 2, stiffness=(stiffness + stiffness.T) / 2,
                   damping=projected(uncoupled.damping),
                   structural_damping=projected(uncoupled.structural_damping), output_map=uncoupled.output_map @ basis,
                   input_map=basis.T @ uncoupled.input_map, coordinates=tuple(f"z{i + 1}" for i in range(basis.shape[1])))


def join_elastically(parts: Mapping[str, SecondOrderSystem], links: Iterable[Link], stiffness: FloatArray,
                     *, damping: FloatArray | None = None, loss_factor: float = 0.0) -> SecondOrderSystem:
    """Join parts by springs across links: K + B^T k B over the coordinates.

    stiffness : (n_links,) N/m or N m/rad, or a full (n_links, n_links) matrix; damping : likewise, N s/m or N m s/rad;
    loss_factor : of these springs, it adds to the structural damping.

    Raises ToolpointError for unknown labels, and for links that repeat each other.

    Examples
    --------
    Two masses of 2 kg on a spring of 1 N/m: w^2 = k (1/m + 1/m) = 1.

    >>> from toolpoint.vibration import SecondOrderSystem
    >>> mass = SecondOrderSystem([[2.0]], [[0.0]], outputs=["end:+x"], inputs=["end:+x"])
    >>> pair = join_elastically({"a": mass, "b": mass}, [("a.end:+x", "b.end:+x")], 1.0)
    >>> (pair.stiffness / 2).tolist()
    [[0.5, -0.5], [-0.5, 0.5]]
    """
    uncoupled = stack_systems(parts)
    rows = _constraint(uncoupled, list(links))
    n = len(rows)

    def matrix(name: str, value: FloatArray | None) -> FloatArray:
        array = np.zeros(n) if value is None else np.asarray(value, float)
        return floats(name, np.diag(np.broadcast_to(array, n)) if array.ndim < 2 else array, (n, n))

    added = rows.T @ matrix("stiffness", stiffness) @ rows
    viscous = rows.T @ matrix("damping", damping) @ rows
    zero = np.zeros_like(added)
    structural = (zero if uncoupled.structural_damping is None else uncoupled.structural_damping) + loss_factor * added
    viscous = viscous + (zero if uncoupled.damping is None else uncoupled.damping)
    return replace(uncoupled, stiffness=uncoupled.stiffness + added, damping=viscous if viscous.any() else None,
                   structural_damping=structural if structural.any() else None)


@dataclass(frozen=True, eq=False)
class DualAssembly:
    """Parts side by side with the forces of their links as unknowns; see `couple_dual`.

    uncoupled : all parts as one system; constraint : (n_links, n) over its coordinates; compliance : (n_links,) of the links,
    m/N or rad/(N m), zero where rigid; links : the pairs of labels.
    """

    uncoupled: SecondOrderSystem
    constraint: FloatArray
    compliance: FloatArray
    links: tuple[Link, ...]

    def respond(self, frequency: FloatArray, outputs: Iterable[Dof | str | int] | None = None,
                *, inputs: Iterable[Dof | str | int] | None = None) -> tuple[Frf, ComplexArray]:
        """Solve for receptances, and for the forces (n_f, n_links, n_inputs) that each link puts on its first label.

        frequency : Hz. Raises ToolpointError where a line is an undamped resonance.
        """
        selection = self.uncoupled.selected(outputs, inputs)
        n, links = selection.size, len(self.constraint)
        f = np.atleast_1d(nonnegative("frequency", floats("frequency", frequency)))
        system = np.zeros((f.size, n + links, n + links), complex)
        for line, hz in enumerate(f):
            system[line, :n, :n] = selection.dynamic_stiffness(2 * np.pi * float(hz))
        # [Z, B^T; B, -C] [q; lambda] = [f; 0], the equations of the module's docstring over the coordinates.
        system[:, :n, n:], system[:, n:, :n] = self.constraint.T, self.constraint
        system[:, range(n, n + links), range(n, n + links)] = -self.compliance
        right = np.zeros((n + links, len(selection.inputs)), complex)
        right[:n] = selection.input_map
        try:
            solution = np.linalg.solve(system, np.broadcast_to(right, (f.size, *right.shape)))
        except np.linalg.LinAlgError:
            fail("frequency", "a singular line", "must hold no undamped resonance", remedy="move the lines")
        frf = Frf(f, np.matmul(selection.output_map + 0j, solution[:, :n]), selection.outputs, selection.inputs,
                  notes=selection.notes)
        return frf, -solution[:, n:]


def couple_dual(parts: Mapping[str, SecondOrderSystem], links: Iterable[Link], compliance: FloatArray | float = 0.0
                ) -> DualAssembly:
    """Join parts at links with the forces between them kept as unknowns (dual assembly).

    compliance : of every link, m/N or rad/(N m); zero joins rigidly.

    Raises ToolpointError for unknown labels, links that repeat each other, and a negative compliance.

    Examples
    --------
    A force of 1 N on one of two equal masses joined rigidly: half of it passes through the link.

    >>> from toolpoint.vibration import SecondOrderSystem
    >>> mass = SecondOrderSystem([[2.0]], [[0.0]], outputs=["end:+x"], inputs=["end:+x"])
    >>> dual = couple_dual({"a": mass, "b": mass}, [("a.end:+x", "b.end:+x")])
    >>> _, force = dual.respond([10.0], inputs=["b.end:+x"])
    >>> print(f"{force[0, 0, 0].real:.6f} N")
    0.500000 N
    """
    uncoupled, pairs = stack_systems(parts), tuple(links)
    rows = _constraint(uncoupled, pairs)
    link_compliance = nonnegative("compliance", floats("compliance", np.broadcast_to(np.asarray(compliance, float), len(rows))))
    return DualAssembly(uncoupled, rows, link_compliance, pairs)


def _constraint(uncoupled: SecondOrderSystem, links: Sequence[Link]) -> FloatArray:
    """Return the links over the coordinates, (n_links, n); links that hold a motion twice are refused."""
    rows = link_rows(links, uncoupled.outputs) @ uncoupled.output_map
    norms = np.linalg.norm(rows, axis=1)
    if (norms == 0).any():
        fail("links", f"{links[int(np.argmin(norms))]}", "joins two places that cannot move")
    # A motion that is held twice leaves the force between both links open: the matrix of the dual form would be singular.
    rank = np.linalg.matrix_rank(rows / norms[:, None], tol=LINK_RANK_TOLERANCE)
    if rank < len(rows):
        fail("links", f"{len(rows)} links of rank {rank}", "must hold different motions",
             remedy="leave out links that follow from others (a part with few coordinates cannot follow many links)")
    return rows


