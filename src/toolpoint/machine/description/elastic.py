"""The description of an elastic body in a machine file: a casting of boxes, its materials, its interfaces; plain data, SI."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated

import numpy as np

from toolpoint._check import fail
from toolpoint._quantity import Quantity

if TYPE_CHECKING:  # finite elements load where a body has them, not with every machine file
    from toolpoint.bodies.solid import Casting, Patch, SolidModel

Length = Annotated[float, Quantity("length", "m")]
Place = tuple[Length, ...]


@dataclass(frozen=True)
class ElasticMaterial:
    """Young's modulus, density and Poisson's ratio of a set of boxes."""

    modulus: Annotated[float, Quantity("pressure", "Pa", above=0)]
    density: Annotated[float, Quantity("density", "kg/m^3", above=0)]
    poisson: Annotated[float, Quantity("ratio", "1", least=0, most=0.49)] = 0.3


@dataclass(frozen=True)
class CastingBox:
    """A box along the axes of the body's frame: material, or (`window`) an opening cut out of what came before."""

    low: Place
    high: Place
    window: bool = False
    material: str = "body"


@dataclass(frozen=True)
class PatchDescription:
    """A rectangle on a flat outer face where a joint, a load or a sensor holds on.

    `along` and `across` are directions of its sides; with `slide` (first and last position along `along`, 0 where it is drawn)
    a joint may move over the body: a carriage on its rail, a limb through its frame. Responses are kept at `stations` so far
    apart, half its length where left out.
    """

    centre: Place
    along: tuple[float, ...]
    across: tuple[float, ...]
    length: Annotated[float, Quantity("length", "m", above=0)]
    width: Annotated[float, Quantity("length", "m", above=0)]
    slide: tuple[Length, ...] = ()
    stations: Annotated[float, Quantity("length", "m", above=0)] | None = None

    @property
    def patch(self) -> Patch:
        """The patch at position 0."""
        for name in ("centre", "along", "across"):
            if len(getattr(self, name)) != 3:
                fail(name, f"{len(getattr(self, name))} numbers", "must be three")
        if len(self.slide) not in (0, 2):
            fail("slide", f"{len(self.slide)} positions", "must be two: first and last")
        from toolpoint.bodies.solid import Patch

        return Patch(np.array(self.centre), np.array(self.along), np.array(self.across), self.length, self.width)


@dataclass(frozen=True)
class ElasticDescription:
    """A body by finite elements: boxes and windows, meshed with elements of at most `mesh_size`, reduced for `band`.

    `band` is the frequency up to which the machine is asked for; `size` the number of elastic
    coordinates, as many as the interfaces ask for where left out.
    """

    boxes: tuple[CastingBox, ...]
    interfaces: Mapping[str, PatchDescription]
    band: Annotated[float, Quantity("frequency", "Hz", above=0)]
    mesh_size: Annotated[float, Quantity("length", "m", above=0)]
    materials: Mapping[str, ElasticMaterial] = field(default_factory=dict)
    size: int | None = None

    @property
    def casting(self) -> Casting:
        """The casting; boxes without a material of their own are of cast iron."""
        for box in self.boxes:
            if len(box.low) != 3 or len(box.high) != 3:
                fail("boxes", f"{len(box.low)} and {len(box.high)} numbers", "must be three each: low and high corner")
        from toolpoint.bodies.solid import CAST_IRON, Casting, Cuboid, Material

        known = {name: Material(m.modulus, m.poisson, m.density) for name, m in self.materials.items()}
        boxes = tuple(Cuboid(np.array(b.low), np.array(b.high), b.material, b.window) for b in self.boxes)
        return Casting(boxes, {"body": CAST_IRON} | known)

    @property
    def model(self) -> SolidModel:
        """The finite-element model in the body's frame."""
        return self.casting.meshed(self.mesh_size)
