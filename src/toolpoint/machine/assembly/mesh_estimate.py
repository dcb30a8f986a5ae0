r"""Estimate of the rise of a machine's natural frequencies at a pose by the meshes of its elastic bodies, from their strains.

A mode of unit modal mass strains its elastic bodies; the energies that their meshes err by in it (`bodies.solid.mesh_energy`)
add up to about :math:`\lambda_h - \lambda`. Joints and rigid bodies add nothing. An estimate, no bound.
"""

from __future__ import annotations

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.machine.parts.model import Machine

MAX_MESH_ERROR = 0.02  # relative error of a frequency from which a mesh is doubted
MESH_ERROR_CEILING = 0.5  # relative error at which the estimate is cut: it is of first order and says no more


def mesh_errors(machine: Machine, omega: FloatArray, vectors: FloatArray) -> FloatArray | None:
    """Return the estimated relative rise of natural frequencies by the meshes of solid bodies, (modes,); None without any.

    omega : (modes,), rad/s; vectors : (n, modes), unit modal mass, in the tree's coordinates.
    """
    solid = [(link, body.mesh_energy) for link, body in enumerate(machine.bodies) if body.mesh_energy is not None]
    if not solid:
        return None
    energy = np.zeros(len(omega))
    for link, energy_form in solid:
        amplitudes = vectors[list(machine.modal_columns[link])]
        energy += np.einsum("im,ij,jm->m", amplitudes, energy_form, amplitudes)
    is_held = omega > 1e-6 * omega.max(initial=0.0)
    return np.where(is_held, np.minimum(energy / np.where(is_held, 2 * omega**2, 1.0), MESH_ERROR_CEILING), 0.0)


def mesh_words(error: FloatArray | None) -> str:
    """Return what the meshes do in words."""
    if error is None:
        return "what their meshes err by is not known"
    worst_mode = int(error.argmax())
    bound_words = "" if error[worst_mode] < MESH_ERROR_CEILING else "at least "
    return (f"their meshes raise them further, by about {bound_words}{100 * max(error[worst_mode], 1e-6):.2g} % (mode "
            f"{worst_mode + 1}; from how strains differ between elements, no bound)")


def is_coarse(error: FloatArray | None) -> bool:
    """Return whether a mesh is to be doubted."""
    return error is not None and float(error.max(initial=0.0)) > MAX_MESH_ERROR
