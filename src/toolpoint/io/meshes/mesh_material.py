"""Materials that a mesh file states, in SI: the file's units of force and mass are those that make them a material."""

from __future__ import annotations

from pathlib import Path

from toolpoint._check import fail
from toolpoint.io.meshes.mesh_content import MeshContent, MeshMaterial
from toolpoint.machine.description.elastic import ElasticMaterial

# Name of the units, Pa and kg/m^3 in one of theirs, by the unit of lengths. Only one of two makes a stated pair a solid.
_UNIT_SYSTEMS = {"m": (("N, m, kg", 1.0, 1.0),), "mm": (("N, mm, t", 1e6, 1e12), ("kN, mm, kg", 1e9, 1e9))}
_MODULUS_LIMITS = (1e7, 1.5e12)  # Pa, from soft plastics to diamond
_DENSITY_LIMITS = (20.0, 25e3)  # kg/m^3, from foams to tungsten


def material_of_file(path: Path, content: MeshContent, name: str, *, unit: str) -> tuple[ElasticMaterial, str]:
    """Return the material that the file gives a set, and a note of what it is; `unit` is that of lengths.

    Raises ToolpointError where the file states none, or numbers that are no solid's in the units that go with its lengths.
    """
    stated = content.materials.get(name, MeshMaterial(name))
    key = f"solid.materials.{name}"
    if stated.modulus is None or stated.density is None:
        fail(key, "missing", "must be given: modulus, density, poisson, loss_factor",
             remedy=f"{path.name} states no isotropic elasticity and density of it")
    for units, pascal, kilograms in _UNIT_SYSTEMS.get(unit, ()):
        modulus, density = stated.modulus * pascal, stated.density * kilograms
        if _is_within(modulus, _MODULUS_LIMITS) and _is_within(density, _DENSITY_LIMITS):
            return (ElasticMaterial(modulus, density, stated.poisson),
                    f"material of {name} from {path.name}, {stated.name} in {units}: {modulus / 1e9:.4g} GPa, {density:.5g} "
                    f"kg/m^3, Poisson's ratio {stated.poisson:g}, no loss factor")
    fail(key, f"{stated.modulus:g} and {stated.density:g} in {path.name}", f"must be a solid's modulus and density in {unit}",
         remedy="give it in the machine file: modulus, density, poisson, loss_factor")


def _is_within(value: float, limits: tuple[float, float]) -> bool:
    return limits[0] <= value <= limits[1]
