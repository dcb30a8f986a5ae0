r"""How far the meshes of elastic bodies may raise a machine's natural frequencies at a pose: about, from their strains.

A mode of unit modal mass strains its elastic bodies; the energies that their meshes err by in it (`bodies.solid.mesh_energy`)
add up to about :math:`\lambda_h - \lambda`. Joints and rigid bodies add nothing. An estimate, no bound.
"""

from __future__ import annotations

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.machine.parts.model import Machine

MESH_LARGE = 0.02  # relative error from which a mesh is doubted
TOO_LARGE = 0.5  # above, a share of the frequency means nothing any more


def mesh_errors(machine: Machine, omega: FloatArray, vectors: FloatArray) -> FloatArray | None:
    """Return by how much the meshes of solid bodies raise natural frequencies, about, relative, (modes,); None without any.

    omega : (modes,), rad/s; vectors : (n, modes), unit modal mass, in the tree's coordinates.
    """
    solid = [(link, body.mesh_energy) for link, body in enumerate(machine.bodies) if body.mesh_energy is not None]
    if not solid:
        return None
    energy = np.zeros(len(omega))
    for link, form in solid:
        bending = vectors[list(machine.modal_columns[link])]
        energy += np.einsum("im,ij,jm->m", bending, form, bending)
    held = omega > 1e-6 * omega.max(initial=0.0)
    return np.where(held, np.minimum(energy / np.where(held, 2 * omega**2, 1.0), TOO_LARGE), 0.0)


def mesh_words(error: FloatArray | None) -> str:
    """Return what the meshes do in words."""
    if error is None:
        return "what their meshes err by is not known"
    worst = int(error.argmax())
    least = "" if error[worst] < TOO_LARGE else "at least "
    return (f"their meshes raise them further, by about {least}{100 * max(error[worst], 1e-6):.2g} % (mode {worst + 1}; from "
            "how strains differ between elements, no bound)")


def is_coarse(error: FloatArray | None) -> bool:
    """Return whether a mesh is to be doubted."""
    return error is not None and float(error.max(initial=0.0)) > MESH_LARGE
