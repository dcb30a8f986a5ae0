"""Sections and materials of bars in bulk data: MAT1, PBAR, PBARL, PBEAM, PBEAML, PROD and CONROD."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from toolpoint.bodies.grid.bar import BarSection
from toolpoint.io.matrices.bulk_cards import BulkCard

SECTION_KEYWORDS = ("PBAR", "PBARL", "PBEAM", "PBEAML", "PROD")
# Dimensions of sections by type (PBARL, PBEAML), and their shear coefficients, as the program takes them.
_DIMENSION_COUNT = {"ROD": 1, "TUBE": 2, "BAR": 2, "BOX": 4}
# Shear factors by the usual tables: a round section, a thin ring, a rectangle; cards of sections state none.
_ROD_SHEAR, _TUBE_SHEAR, _BAR_SHEAR = 0.9, 0.5, 5 / 6
_STATION_WORDS = ("YES", "YESA", "NO")  # begin the lines of a tapered beam's stations


@dataclass(frozen=True)
class BulkMaterial:
    """Moduli E and G and density of a MAT1 card, in the file's units."""

    modulus: float
    shear_modulus: float
    density: float


def read_material(card: BulkCard) -> BulkMaterial:
    """Return the material of a MAT1 card; of E, G and nu the third follows from two."""
    modulus, shear, poisson = (card.real(k) if card.word(k) else None for k in (2, 3, 4))
    if modulus is None and shear is not None and poisson is not None:
        modulus = 2 * (1 + poisson) * shear
    if modulus is None:
        card.refuse("no E", "must have E, or G with nu")
    if shear is None:
        shear = modulus / (2 * (1 + poisson)) if poisson is not None else 0.0
    return BulkMaterial(modulus, shear, card.real(5, 0.0))


def read_section(card: BulkCard, materials: Mapping[int, BulkMaterial]) -> BarSection:
    """Return the section of a property card."""
    material = material_of(card, 2, materials)
    if card.keyword in ("PBARL", "PBEAML"):
        return _shaped_section(card, material)
    if card.keyword == "PROD":
        area, torsion, _, extra = card.reals((3, 4, 5, 6))
        return _section(material, (area, 0.0, 0.0, torsion), extra_mass=extra)
    if card.keyword == "PBEAM":
        return _beam_section(card, material)
    area, first, second, torsion, extra = card.reals(range(3, 8))
    _refuse_product(card, card.real(19, 0.0))
    return _section(material, (area, first, second, torsion), extra_mass=extra, shears=(card.real(17, 0.0), card.real(18, 0.0)))


def rod_section(card: BulkCard, materials: Mapping[int, BulkMaterial]) -> BarSection:
    """Return the section that a CONROD card itself states."""
    area, torsion, _, extra = card.reals((5, 6, 7, 8))
    return _section(material_of(card, 4, materials), (area, 0.0, 0.0, torsion), extra_mass=extra)


def material_of(card: BulkCard, place: int, materials: Mapping[int, BulkMaterial]) -> BulkMaterial:
    """Return the material that a field of a card names."""
    number = card.whole(place)
    if number not in materials:
        card.refuse(f"material {number}", "must be a MAT1 of this file")
    return materials[number]


def _section(material: BulkMaterial, areas: tuple[float, float, float, float], *, extra_mass: float,
             shears: tuple[float, float] = (0.0, 0.0)) -> BarSection:
    """Return a section of area, I1, I2 and J; a shear coefficient of 0 is a section that does not shear."""
    area, first, second, torsion = areas
    e, g, rho = material.modulus, material.shear_modulus, material.density
    rigidity = [k * g * area if k * g * area > 0 else np.inf for k in shears]
    return BarSection(e * area, g * torsion, e * first, e * second, rigidity[0], rigidity[1], rho * area + extra_mass,
                      rho * first, rho * second)


def _refuse_product(card: BulkCard, product: float) -> None:
    if product:
        card.refuse(f"I12 = {product:g}", "must be 0; turn the orientation vector to the principal axes of the section")


def _beam_section(card: BulkCard, material: BulkMaterial) -> BarSection:
    """Return a PBEAM of one section all along; its shear coefficients are 1 where left out, as the program takes them."""
    area, first, second, product, torsion, extra = card.reals(range(3, 9))
    _refuse_product(card, product)
    lines = [card.fields[k:k + 8] for k in range(9, len(card.fields), 8)]
    if lines and lines[0][0].strip().upper() not in _STATION_WORDS:
        lines = lines[1:]  # where stresses are recovered
    while lines and lines[0][0].strip().upper() in _STATION_WORDS:
        station = BulkCard(card.path, card.line, (card.keyword, *lines[0]))
        first_values = (area, first, second, product, torsion)
        values = [station.real(k, default) for k, default in zip(range(3, 8), first_values, strict=True)]
        if not np.allclose(values, first_values, rtol=1e-9, atol=0):
            card.refuse("a section that changes along the beam", "must be one; divide the beam into pieces")
        lines = lines[2:] if lines[0][0].strip().upper() == "YES" else lines[1:]
    shears = BulkCard(card.path, card.line, (card.keyword, *(lines[0] if lines else ())))
    return _section(material, (area, first, second, torsion), extra_mass=extra,
                    shears=(shears.real(1, 1.0), shears.real(2, 1.0)))


def _shaped_section(card: BulkCard, material: BulkMaterial) -> BarSection:
    """Return a section by type and dimensions."""
    kind = card.word(4).upper()
    if kind not in _DIMENSION_COUNT:
        card.refuse(f"section {kind or 'without a type'}",
                    f"must be one of {', '.join(_DIMENSION_COUNT)}; give others as PBAR, by A, I1, I2 and J")
    count = _DIMENSION_COUNT[kind]
    sizes = card.reals(range(9, 9 + count), None)
    extra = card.real(9 + count, 0.0)
    if card.words(10 + count):
        card.refuse("a section that changes along the beam", "must be one; divide the beam into pieces")
    if min(sizes) <= 0 and not (kind == "TUBE" and sizes[1] == 0 < sizes[0]):
        card.refuse(f"dimensions {', '.join(f'{size:g}' for size in sizes)}", "must be above 0")
    areas, shears = _SHAPES[kind](sizes)
    if not min(areas) > 0:
        card.refuse(f"dimensions {', '.join(f'{size:g}' for size in sizes)}", "must leave an area")
    return _section(material, areas, extra_mass=extra, shears=shears)


def _round(sizes: list[float]) -> tuple[tuple[float, float, float, float], tuple[float, float]]:
    """Return area, I1, I2, J and shear coefficients of a rod or tube of outer (and inner) radius."""
    radius, bore_radius = sizes[0], sizes[1] if len(sizes) > 1 else 0.0
    second = np.pi / 4 * (radius**4 - bore_radius**4)
    shear = _TUBE_SHEAR if bore_radius else _ROD_SHEAR
    return (np.pi * (radius**2 - bore_radius**2), second, second, 2 * second), (shear, shear)


def _rectangular(sizes: list[float]) -> tuple[tuple[float, float, float, float], tuple[float, float]]:
    """Return those of a rectangle of width (along z) and height (along y); torsion by Roark, table 10.7."""
    width, height = sizes
    longer, shorter = max(sizes), min(sizes)
    # Saint-Venant's constant of a rectangle by its usual closed form, within 0.5 % for all ratios of the sides.
    torsion = longer * shorter**3 * (1 / 3 - 0.21 * shorter / longer * (1 - shorter**4 / (12 * longer**4)))
    return (width * height, width * height**3 / 12, height * width**3 / 12, torsion), (_BAR_SHEAR, _BAR_SHEAR)


def _hollow_box(sizes: list[float]) -> tuple[tuple[float, float, float, float], tuple[float, float]]:
    """Return those of a box of width, height, thickness of top and bottom, and of the sides; torsion by Bredt's formula."""
    width, height, plate, side = sizes
    inner_width, inner_height = width - 2 * side, height - 2 * plate
    area = width * height - inner_width * inner_height
    if inner_width <= 0 or inner_height <= 0:
        return (0.0, 0.0, 0.0, 0.0), (0.0, 0.0)
    torsion = 2 * plate * side * (width - side)**2 * (height - plate)**2 / (width * side + height * plate - side**2 - plate**2)
    seconds = [(b * h**3 - inner_b * inner_h**3) / 12 for b, h, inner_b, inner_h in (
        (width, height, inner_width, inner_height), (height, width, inner_height, inner_width))]
    return (area, seconds[0], seconds[1], torsion), (2 * side * inner_height / area, 2 * plate * inner_width / area)


_SHAPES = {"ROD": _round, "TUBE": _round, "BAR": _rectangular, "BOX": _hollow_box}
