"""The description of a beam body in a machine file: stepped round or rectangular segments of several materials; plain data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Annotated, Literal

from toolpoint._check import fail
from toolpoint._quantity import Quantity

if TYPE_CHECKING:  # what computes loads where a body is a beam, not with every machine file
    from toolpoint.bodies.beam import BeamSection
    from toolpoint.bodies.reduced import ElasticNumbers

Length = Annotated[float, Quantity("length", "m", above=0)]
BeamMaterial = Literal["steel", "carbide", "high-speed steel"]


@dataclass(frozen=True)
class SleeveDescription:
    """A ring bonded around a round segment: a bearing spacer, a rotor's sheets, carbon fibre; it adds to the section."""

    diameter: Length
    material: BeamMaterial = "steel"
    modulus: Annotated[float, Quantity("pressure", "Pa", above=0)] | None = None
    density: Annotated[float, Quantity("density", "kg/m^3", above=0)] | None = None
    poisson: Annotated[float, Quantity("ratio", "1", least=0, most=0.49)] | None = None
    loss_factor: Annotated[float, Quantity("ratio", "1", least=0, most=2)] = 0.0

    def ring(self, bore: float) -> BeamSection:
        """Section of the ring alone around a segment of this diameter (m)."""
        from toolpoint.bodies.beam import ring
        from toolpoint.substructuring.shaft import shear_coefficient

        e, rho, nu = _numbers(self)
        return ring(self.diameter, bore, e, density=rho, poisson=nu, shear=shear_coefficient(nu, bore / self.diameter))


@dataclass(frozen=True)
class BeamSegment:
    """A segment of one section: round (`diameter`, `bore`) or rectangular (`width` along the first, `height` along the second
    direction across the axis).

    Modulus, density and Poisson's ratio are those of the material where left out. Round sections shear by Cowper's coefficient.
    """

    length: Length
    diameter: Length | None = None
    bore: Annotated[float, Quantity("length", "m", least=0)] = 0.0
    width: Length | None = None
    height: Length | None = None
    material: BeamMaterial = "steel"
    modulus: Annotated[float, Quantity("pressure", "Pa", above=0)] | None = None
    density: Annotated[float, Quantity("density", "kg/m^3", above=0)] | None = None
    poisson: Annotated[float, Quantity("ratio", "1", least=0, most=0.49)] | None = None
    sleeve: SleeveDescription | None = None
    loss_factor: Annotated[float, Quantity("ratio", "1", least=0, most=2)] = 0.0

    @property
    def section(self) -> BeamSection:
        """Rigidities and inertia of the whole section, x along the beam."""
        return self.core if self.sleeve is None or self.diameter is None else self.core + self.sleeve.ring(self.diameter)

    @property
    def core(self) -> BeamSection:
        """Those of the section without its sleeve."""
        from toolpoint.bodies.beam import rectangle, ring
        from toolpoint.substructuring.shaft import shear_coefficient

        e, rho, nu = _numbers(self)
        if self.diameter is None:
            if self.width is None or self.height is None:
                fail("diameter", "missing", "a segment needs a diameter, or width and height")
            if self.sleeve is not None or self.bore:
                fail("sleeve" if self.sleeve is not None else "bore", "of a rectangular segment", "is for round ones",
                     remedy="give a diameter in place of width and height")
            return rectangle(self.width, self.height, e, density=rho, poisson=nu)
        if self.width is not None or self.height is not None:
            fail("width", "given beside a diameter", "must be one or the other", remedy="remove one of them")
        shear = shear_coefficient(nu, self.bore / self.diameter)
        return ring(self.diameter, self.bore, e, density=rho, poisson=nu, shear=shear)

    @property
    def extent(self) -> tuple[float, float]:
        """Width and height that the segment takes up, m."""
        outer_diameter = self.diameter if self.sleeve is None else self.sleeve.diameter
        return (outer_diameter, outer_diameter) if outer_diameter is not None else (self.width or 0.0, self.height or 0.0)


def _numbers(part: BeamSegment | SleeveDescription) -> tuple[float, float, float]:
    """Return Young's modulus (Pa), density (kg/m^3) and Poisson's ratio."""
    from toolpoint.substructuring.shaft import MATERIALS

    material_values = MATERIALS[part.material]
    e, rho, nu = (material_value if stated is None else stated for stated, material_value in zip(
        (part.modulus, part.density, part.poisson), material_values, strict=True))
    return e, rho, nu


@dataclass(frozen=True)
class BeamDescription:
    """A body by Timoshenko beam elements along an axis of its frame, from its origin on.

    `segments` follow each other; `interfaces` are the distances from the origin at which joints, loads and points hold on;
    `band` is the frequency up to which the machine is asked for.
    """

    segments: Mapping[str, BeamSegment]
    interfaces: Mapping[str, Annotated[float, Quantity("length", "m", least=0)]]
    band: Annotated[float, Quantity("frequency", "Hz", above=0)]
    axis: Literal["x", "y", "z"] = "z"
    damping_ratio: Annotated[float, Quantity("ratio", "1", least=0, most=0.5)] = field(default=0.0)

    @property
    def numbers(self) -> dict[str, ElasticNumbers]:
        """Modulus, density and loss factor of every segment and sleeve (``segment.sleeve``)."""
        from toolpoint.bodies.reduced import ElasticNumbers

        parts: dict[str, BeamSegment | SleeveDescription] = {}
        for name, segment in self.segments.items():
            parts[name] = segment
            if segment.sleeve is not None:
                parts[f"{name}.sleeve"] = segment.sleeve
        return {name: ElasticNumbers(*_numbers(part)[:2], part.loss_factor) for name, part in parts.items()}

    @property
    def frozen_text(self) -> str:
        """Everything but these numbers: beams with the same text differ by scales alone."""
        unscaled = {name: replace(segment, modulus=None, density=None, loss_factor=0.0,
                                  sleeve=None if segment.sleeve is None else
                                  replace(segment.sleeve, modulus=None, density=None, loss_factor=0.0))
                    for name, segment in self.segments.items()}
        return repr(replace(self, segments=unscaled))

    @property
    def length(self) -> float:
        """Length of the beam, m."""
        return sum(segment.length for segment in self.segments.values())
