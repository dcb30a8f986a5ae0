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
from toolpoint.substructuring.parts import Link, link_rows, set_systems_apart
from toolpoint.vibration import Dof, Frf, SecondOrderSystem

REPEATED = 1e-10


def couple(parts: Mapping[str, SecondOrderSystem], links: Iterable[Link]) -> SecondOrderSystem:
    """Return parts joined rigidly at links, in coordinates that satisfy them (primal assembly).

    Parameters
    ----------
    parts : mapping of name to SecondOrderSystem
        Of one pose. The labels of the whole are ``part.point:direction``.
    links : pairs of labels of outputs that move together

    Raises
    ------
    ToolpointError
        For unknown labels, links that repeat each other, or links that leave no motion.
    """
    apart = set_systems_apart(parts)
    constraint = _constraint(apart, list(links))
    basis = null_space(constraint / np.linalg.norm(constraint, axis=1, keepdims=True), rcond=REPEATED)
    if basis.shape[1] == 0:
        fail("links", f"{len(constraint)} links", "must leave a motion", remedy="give parts more coordinates")

    def projected(matrix: FloatArray | None) -> FloatArray | None:
        return None if matrix is None else basis.T @ matrix @ basis

    mass, stiffness = projected(apart.mass), projected(apart.stiffness)
    assert mass is not None and stiffness is not None
    return replace(apart, mass=(mass + mass.T) / 2, stiffness=(stiffness + stiffness.T) / 2, damping=projected(apart.damping),
                   structural_damping=projected(apart.structural_damping), output_map=apart.output_map @ basis,
                   input_map=basis.T @ apart.input_map, coordinates=tuple(f"z{i + 1}" for i in range(basis.shape[1])))


def join_elastically(parts: Mapping[str, SecondOrderSystem], links: Iterable[Link], stiffness: FloatArray,
                     *, damping: FloatArray | None = None, loss_factor: float = 0.0) -> SecondOrderSystem:
    """Return parts joined by springs: one stiffness (N/m, N m/rad) a link, or a full matrix over the links."""
    apart = set_systems_apart(parts)
    rows = _constraint(apart, list(links))
    n = len(rows)

    def matrix(name: str, value: FloatArray | None) -> FloatArray:
        given = np.zeros(n) if value is None else np.asarray(value, float)
        return floats(name, np.diag(np.broadcast_to(given, n)) if given.ndim < 2 else given, (n, n))

    added = rows.T @ matrix("stiffness", stiffness) @ rows
    viscous = rows.T @ matrix("damping", damping) @ rows
    zero = np.zeros_like(added)
    structural = (zero if apart.structural_damping is None else apart.structural_damping) + loss_factor * added
    viscous = viscous + (zero if apart.damping is None else apart.damping)
    return replace(apart, stiffness=apart.stiffness + added, damping=viscous if viscous.any() else None,
                   structural_damping=structural if structural.any() else None)


@dataclass(frozen=True, eq=False)
class DualAssembly:
    """Parts side by side and the links that hold them, the forces of the links as unknowns; see `couple_dual`.

    apart : all parts as one system; constraint : (n_links, n) over its coordinates; compliance : (n_links,) of the links,
    m/N or rad/(N m), zero where rigid; links : the pairs of labels.
    """

    apart: SecondOrderSystem
    constraint: FloatArray
    compliance: FloatArray
    links: tuple[Link, ...]

    def respond(self, frequency: FloatArray, outputs: Iterable[Dof | str | int] | None = None,
                *, inputs: Iterable[Dof | str | int] | None = None) -> tuple[Frf, ComplexArray]:
        """Return receptances, and the forces (n_f, n_links, n_inputs) that each link puts on its first label."""
        seen = self.apart.selected(outputs, inputs)
        n, links = seen.size, len(self.constraint)
        f = np.atleast_1d(nonnegative("frequency", floats("frequency", frequency)))
        system = np.zeros((f.size, n + links, n + links), complex)
        for line, hz in enumerate(f):
            system[line, :n, :n] = seen.dynamic_stiffness(2 * np.pi * float(hz))
        system[:, :n, n:], system[:, n:, :n] = self.constraint.T, self.constraint
        system[:, range(n, n + links), range(n, n + links)] = -self.compliance
        right = np.zeros((n + links, len(seen.inputs)), complex)
        right[:n] = seen.input_map
        try:
            solution = np.linalg.solve(system, np.broadcast_to(right, (f.size, *right.shape)))
        except np.linalg.LinAlgError:
            fail("frequency", "a singular line", "must hold no undamped resonance", remedy="move the lines")
        frf = Frf(f, np.matmul(seen.output_map + 0j, solution[:, :n]), seen.outputs, seen.inputs, notes=seen.notes)
        return frf, -solution[:, n:]


def couple_dual(parts: Mapping[str, SecondOrderSystem], links: Iterable[Link], compliance: FloatArray | float = 0.0
                ) -> DualAssembly:
    """Return parts joined at links with the forces between them kept as unknowns (dual assembly).

    compliance : of every link, m/N or rad/(N m); zero joins rigidly.
    """
    apart, pairs = set_systems_apart(parts), tuple(links)
    rows = _constraint(apart, pairs)
    soft = nonnegative("compliance", floats("compliance", np.broadcast_to(np.asarray(compliance, float), len(rows))))
    return DualAssembly(apart, rows, soft, pairs)


def _constraint(apart: SecondOrderSystem, links: Sequence[Link]) -> FloatArray:
    """Return the links over the coordinates; links that hold a motion twice are refused."""
    rows = link_rows(links, apart.outputs) @ apart.output_map
    size = np.linalg.norm(rows, axis=1)
    if (size == 0).any():
        fail("links", f"{links[int(np.argmin(size))]}", "joins two places that cannot move")
    rank = np.linalg.matrix_rank(rows / size[:, None], tol=REPEATED)
    if rank < len(rows):
        fail("links", f"{len(rows)} links of rank {rank}", "must hold different motions",
             remedy="leave out links that follow from others (a part with few coordinates cannot follow many links)")
    return rows


