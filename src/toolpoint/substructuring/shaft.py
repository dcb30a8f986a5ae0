"""Stepped round shafts (holder, gauge, tool) as plain data: segments from the base to the tip, contacts between them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Literal

import numpy as np

from toolpoint._check import ComplexArray, FloatArray, ToolpointError, fail, suggestion
from toolpoint._notebook import NotebookText
from toolpoint._quantity import Quantity, limit_faults

# Young's modulus (Pa), density (kg/m^3), Poisson's ratio: handbook values, which a tool may miss by some per cent.
MATERIALS = {"steel": (210e9, 7850.0, 0.30), "carbide": (580e9, 14500.0, 0.22), "high-speed steel": (220e9, 8160.0, 0.30)}
# Equivalent diameter of a fluted segment over the cutter's; Kops, Vo, Annals of the CIRP 39/1 (1990): 0.8 within some per cent.
FLUTED_DIAMETER_RATIO = 0.8


@dataclass(frozen=True)
class ContactDescription:
    """Elastic contact between a segment and the section before it (taper, collet, shrink fit).

    `stiffness` against a shift across the axis, `rotational_stiffness` against tilting.

    Examples
    --------
    >>> ContactDescription(stiffness=1e8, rotational_stiffness=1e5).loss_factor
    0.0
    """

    stiffness: Annotated[float, Quantity("stiffness", "N/m", above=0)]
    rotational_stiffness: Annotated[float, Quantity("rotational stiffness", "N*m/rad", above=0)]
    loss_factor: Annotated[float, Quantity("ratio", "1", least=0, most=2)] = 0.0


@dataclass(frozen=True)
class SegmentDescription:
    """Round segment of one diameter and material.

    `fluted` segments count with `equivalent` times their diameter. Modulus, density and Poisson's ratio are those of the
    material where left out. `contact` joins it to the section before it; without one the joint is rigid.

    Examples
    --------
    >>> round(SegmentDescription(length=0.1, diameter=0.02).mass, 4)  # steel, kg
    0.2466
    """

    length: Annotated[float, Quantity("length", "m", above=0)]
    diameter: Annotated[float, Quantity("length", "m", above=0)]
    bore: Annotated[float, Quantity("length", "m", least=0)] = 0.0
    material: Literal["steel", "carbide", "high-speed steel"] = "steel"
    fluted: bool = False
    equivalent: Annotated[float, Quantity("ratio", "1", above=0.3, most=1)] = FLUTED_DIAMETER_RATIO
    modulus: Annotated[float, Quantity("pressure", "Pa", above=0)] | None = None
    density: Annotated[float, Quantity("density", "kg/m^3", above=0)] | None = None
    poisson: Annotated[float, Quantity("ratio", "1", least=0, most=0.49)] | None = None
    loss_factor: Annotated[float, Quantity("ratio", "1", least=0, most=1)] = 0.0
    shear: Literal["cowper", "hutchinson"] = "cowper"
    contact: ContactDescription | None = None

    @property
    def numbers(self) -> tuple[float, float, float]:
        """Young's modulus (Pa), density (kg/m^3) and Poisson's ratio."""
        modulus, density, poisson = MATERIALS[self.material]
        stated = (self.modulus, self.density, self.poisson)
        handbook = (modulus, density, poisson)
        e, rho, nu = (usual if value is None else value for value, usual in zip(stated, handbook, strict=True))
        return e, rho, nu

    @property
    def effective_diameter(self) -> float:
        """Diameter of the bending section, m: the equivalent one of a fluted segment."""
        return self.equivalent * self.diameter if self.fluted else self.diameter

    @property
    def mass(self) -> float:
        """Mass, kg."""
        return float(self.numbers[1] * np.pi / 4 * (self.effective_diameter**2 - self.bore**2) * self.length)

    @property
    def row(self) -> ComplexArray:
        r"""Density, E, :math:`\kappa G`, area, second moment, length, kind, as the kernels take them; shape (7,)."""
        e, rho, nu = self.numbers
        lossy, diameter = 1 + 1j * self.loss_factor, self.effective_diameter
        area, second = np.pi / 4 * (diameter**2 - self.bore**2), np.pi / 64 * (diameter**4 - self.bore**4)
        return np.array([rho, e * lossy, shear_coefficient(nu, self.bore / diameter, self.shear) * e / (2 * (1 + nu)) * lossy,
                         area, second, self.length, 0])


def shear_coefficient(poisson: float, ratio: float = 0.0, source: str = "cowper") -> float:
    r"""Return Timoshenko's shear coefficient of a round section with bore ratio m = d_i/d_o.

    Cowper, J. Appl. Mech. 33 (1966): :math:`6(1+\nu)(1+m^2)^2 / ((7+6\nu)(1+m^2)^2 + (20+12\nu) m^2)`; Hutchinson,
    J. Appl. Mech. 68 (2001), solid sections: :math:`6(1+\nu)^2 / (7+12\nu+4\nu^2)`.
    """
    nu, m = poisson, ratio**2
    if source == "hutchinson":
        if ratio > 0:
            fail("shear", "'hutchinson' for a bored segment", "is for solid sections", remedy="use cowper")
        return 6 * (1 + nu) ** 2 / (7 + 12 * nu + 4 * nu**2)
    return 6 * (1 + nu) * (1 + m) ** 2 / ((7 + 6 * nu) * (1 + m) ** 2 + (20 + 12 * nu) * m)


@dataclass(frozen=True)
class ShaftDescription(NotebookText):
    """Stepped round shaft (holder, gauge or tool): named segments from the base outward.

    `stations` of a gauge are the distances of its measured points from the base plane. Deviations are one standard deviation:
    of all diameters and moduli as shares (each segment for itself), of all stations as a length, of a fluted segment's
    equivalent ratio.

    Raises
    ------
    ToolpointError
        For numbers beyond their limits, a bore that is not smaller than the diameter, and a station beyond the tip.

    Examples
    --------
    >>> ShaftDescription({"shank": SegmentDescription(0.05, 0.012, material="carbide")}, name="end mill")
    ShaftDescription(end mill: shank 50 mm x 12 mm; 0.082 kg)
    """

    segments: Mapping[str, SegmentDescription]
    name: str = ""
    stations: Mapping[str, Annotated[float, Quantity("length", "m", least=0)]] = field(default_factory=dict)
    diameter_deviation: Annotated[float, Quantity("ratio", "1", least=0, most=0.2)] = 0.0
    modulus_deviation: Annotated[float, Quantity("ratio", "1", least=0, most=0.5)] = 0.0
    equivalent_deviation: Annotated[float, Quantity("ratio", "1", least=0, most=0.2)] = 0.0
    contact_deviation: Annotated[float, Quantity("ratio", "1", least=0, most=1)] = 0.0
    station_deviation: Annotated[float, Quantity("length", "m", least=0)] = 0.0
    source: str = ""

    def __post_init__(self) -> None:
        for key, text in shaft_faults(self):
            raise ToolpointError(f"{'.'.join(map(str, key))}: {text}", argument=".".join(map(str, key)))

    @property
    def length(self) -> float:
        """Distance from the base plane to the tip, m."""
        return sum(segment.length for segment in self.segments.values())

    @property
    def mass(self) -> float:
        """Mass, kg."""
        return sum(segment.mass for segment in self.segments.values())

    @property
    def polar_inertia(self) -> float:
        """Moment of inertia about the axis, kg m^2."""
        return sum(part.mass * (part.effective_diameter**2 + part.bore**2) / 8 for part in self.segments.values())

    @property
    def rows(self) -> ComplexArray:
        """Rows of the kernels, contacts among them, from the base outward; shape (n, 7)."""
        rows: list[ComplexArray] = []
        for segment in self.segments.values():
            if segment.contact is not None:
                lossy = 1 + 1j * segment.contact.loss_factor
                # Compliances, not stiffnesses: a contact that is rigid in one direction is a plain zero.
                rows.append(np.array([0, 1 / (segment.contact.stiffness * lossy),
                                      1 / (segment.contact.rotational_stiffness * lossy), 0, 0, 0, 1]))
            rows.append(segment.row)
        return np.array(rows)

    def with_length(self, name: str, length: float) -> ShaftDescription:
        """Return the shaft with another length (m) of one segment: another stick-out."""
        if name not in self.segments:
            fail("segment", f"no {name!r}", f"must be of {', '.join(self.segments)}", remedy=suggestion(name, self.segments))
        return replace(self, segments={**self.segments, name: replace(self.segments[name], length=length)})

    def drawn(self, generator: np.random.Generator) -> ShaftDescription:
        """Return the shaft with its numbers drawn from their deviations (stations normal, positive numbers log-normal)."""
        segments = {name: self._drawn_segment(part, generator) for name, part in self.segments.items()}
        shifts = generator.normal(size=len(self.stations)) * self.station_deviation
        places = {name: float(np.clip(position + shift, 0.0, sum(s.length for s in segments.values())))
                  for (name, position), shift in zip(self.stations.items(), shifts, strict=True)}
        return replace(self, segments=segments, stations=places)

    def _drawn_segment(self, segment: SegmentDescription, generator: np.random.Generator) -> SegmentDescription:
        normal: FloatArray = generator.normal(size=5)
        contact = segment.contact
        if contact is not None:
            factors = np.exp(self.contact_deviation * normal[3:])
            contact = replace(contact, stiffness=contact.stiffness * float(factors[0]),
                              rotational_stiffness=contact.rotational_stiffness * float(factors[1]))
        deviation = np.hypot(self.diameter_deviation, self.equivalent_deviation if segment.fluted else 0.0)
        diameter = segment.diameter * float(np.exp(deviation * normal[0]))
        # A drawn diameter below the bore would give a negative area.
        return replace(segment, diameter=max(diameter, 1.0001 * segment.bore), contact=contact,
                       modulus=segment.numbers[0] * float(np.exp(self.modulus_deviation * normal[1])))

    @property
    def words(self) -> str:
        """The shaft in a line: segments with length and diameter, mass."""
        parts = ", ".join(f"{name} {1e3 * s.length:.4g} mm x {1e3 * s.diameter:.4g} mm" for name, s in self.segments.items())
        return f"{self.name or 'shaft'}: {parts}; {self.mass:.4g} kg"

    def __repr__(self) -> str:
        return f"ShaftDescription({self.words})"


def shaft_faults(shaft: ShaftDescription) -> list[tuple[tuple[str | int, ...], str]]:
    """Return key and text of every fault of a shaft; empty where there is none."""
    faults = list(limit_faults(shaft))
    if not shaft.segments:
        faults.append((("segments",), "none; a shaft has at least one segment"))
    for name, part in shaft.segments.items():
        if part.bore >= part.effective_diameter:
            faults.append((("segments", name, "bore"),
                           f"{1e3 * part.bore:g} mm in a diameter of {1e3 * part.effective_diameter:g} mm; must "
                           "be smaller"))
    for name, position in shaft.stations.items():
        if position > shaft.length * (1 + 1e-12):
            faults.append((("stations", name), f"{1e3 * position:g} mm from the base; the tip is at {1e3 * shaft.length:g} mm"))
    return faults
