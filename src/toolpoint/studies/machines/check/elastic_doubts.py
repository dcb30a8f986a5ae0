"""Doubts about elastic bodies that only their numbers reveal: impossible materials, meshes too coarse for their band."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from toolpoint._doubt import Doubt
from toolpoint.machine import Machine
from toolpoint.machine.assembly.shapes import body_shapes
from toolpoint.machine.description.elastic import ElasticDescription, ElasticMaterial, SolidBody

MAX_MATERIAL_MODULUS, MIN_MATERIAL_MODULUS = 1e12, 1e8  # Pa: above diamond, below soft plastics
MIN_MATERIAL_DENSITY = 20.0  # kg/m^3: below foam
MIN_ELEMENTS_PER_WAVE = 2.0  # quadratic elements in a shear wave at the highest frequency of the band


def question_elastic_bodies(machine: Machine) -> list[Doubt]:
    """Return doubts about materials and meshes of elastic bodies, and about motions at 0 Hz of a machine that has some."""
    lines = list[Doubt]()
    for name, body in machine.description.bodies.items():
        part = body.elastic or body.solid
        if part is None:
            continue
        kind = "elastic" if body.elastic is not None else "solid"
        for label, material in part.materials.items():
            lines += _question_material(f"bodies.{name}.{kind}.materials.{label}", material)
        lines += _question_mesh(f"bodies.{name}.{kind}", part)
    return [*lines, *_question_mechanisms(machine)]


def _question_material(path: str, material: ElasticMaterial) -> Iterator[Doubt]:
    """Yield doubts about modulus and density of a material; path : its place in the machine file."""
    if not MIN_MATERIAL_MODULUS <= material.modulus <= MAX_MATERIAL_MODULUS:
        word = "stiffer than diamond" if material.modulus > MAX_MATERIAL_MODULUS else "softer than plastic"
        yield Doubt(f"{path}.modulus", f"{material.modulus:.3g} Pa, {word}", "check its unit (a number without one is in Pa)",
                    figure=material.modulus)
    if material.density < MIN_MATERIAL_DENSITY:
        yield Doubt(f"{path}.density", f"{material.density:.3g} kg/m^3, lighter than foam",
                    "check its unit (a number without one is in kg/m^3; iron has 7200)", figure=material.density)


def _question_mesh(path: str, part: ElasticDescription | SolidBody) -> Iterator[Doubt]:
    """Yield a doubt where the shortest shear wave of all materials, at the end of the band, holds too few elements."""
    if part.mesh_size is None:
        return
    waves = {name: np.sqrt(m.modulus / (2 * (1 + m.poisson) * m.density)) / part.band for name, m in part.materials.items()}
    shortest = min(waves.values(), default=np.inf)
    if part.mesh_size * MIN_ELEMENTS_PER_WAVE > shortest:
        yield Doubt(f"{path}.mesh_size",
                    f"{1e3 * part.mesh_size:.3g} mm is less than {MIN_ELEMENTS_PER_WAVE:g} elements a shear wave at "
                    f"the band of {part.band:.4g} Hz ({1e3 * shortest:.3g} mm), so modes up to there are not those of the body",
                    "write smaller elements, or the band that is needed", figure=part.mesh_size / shortest)


def _question_mechanisms(machine: Machine) -> Iterator[Doubt]:
    """Yield a doubt for each motion at 0 Hz at the reference pose, of the twelve lowest modes, named by its joint.

    Asked of machines with elastic bodies only.
    """
    if not any(body.modal_count for body in machine.bodies):
        return
    try:
        free = body_shapes(machine, {}, 12).mechanisms()
    except ValueError:  # a pose that cannot be, or is not in balance, says so where it is asked for
        return
    for name in free:
        joint, _, way = name.rpartition(".")
        yield Doubt(f"joints.{joint}", f"nothing holds {way}: a mode at 0 Hz at the reference pose",
                    "give the joint stiffness there, or a drive; leave it where it is meant to be free")
