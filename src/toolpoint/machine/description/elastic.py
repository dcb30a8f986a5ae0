"""Descriptions of elastic bodies in a machine file: a casting of boxes, or the solid of a STEP or mesh file; plain data, SI."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from operator import attrgetter
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np

from toolpoint._check import FloatArray, fail, within
from toolpoint._quantity import Quantity

if TYPE_CHECKING:  # finite elements load where a body has them, not with every machine file
    from toolpoint.bodies.reduced import ElasticNumbers
    from toolpoint.bodies.solid import Casting, Material, Patch, RoundCasting, SolidModel
    from toolpoint.bodies.solid.region import SolidPlace

Length = Annotated[float, Quantity("length", "m")]
Place = tuple[Length, ...]


@dataclass(frozen=True)
class ElasticMaterial:
    """Young's modulus, density, Poisson's ratio and structural loss factor of a set."""

    modulus: Annotated[float, Quantity("pressure", "Pa", above=0)]
    density: Annotated[float, Quantity("density", "kg/m^3", above=0)]
    poisson: Annotated[float, Quantity("ratio", "1", least=0, most=0.49)] = 0.3
    loss_factor: Annotated[float, Quantity("ratio", "1", least=0, most=2)] = 0.0


HELD_INTERFACE = "held"  # name of the interface of a node set that moves as one rigid piece
CAST_IRON = ElasticMaterial(110e9, 7200.0, 0.26, 2e-3)  # as `bodies.solid.CAST_IRON`


@dataclass(frozen=True)
class CastingBox:
    """A box along the axes of the body's frame: material, or (`window`) an opening cut out of what came before.

    round : the direction of the cylinder's axis where it is the cylinder that fits in the box. A casting is of boxes alone, or
    of cylinders and bores about one axis.
    """

    low: Place
    high: Place
    window: bool = False
    material: str = "body"
    round: Literal["", "x", "y", "z"] = ""


_RECTANGLE_KEYS = ("centre", "along", "across", "length", "width")
_WAYS_OF_PLACE = ("surface", "nodes", "cylinder", "ring", "plane")


@dataclass(frozen=True)
class CylinderDescription:
    """The wall of a bore or a journal about `axis` through `at`; half of `length` lies on each side of `at`."""

    at: Place
    axis: tuple[float, ...]
    diameter: Annotated[float, Quantity("length", "m", above=0)]
    length: Annotated[float, Quantity("length", "m", above=0)]


@dataclass(frozen=True)
class RingDescription:
    """A ring on a flat outer face about `normal` through `at`, between two diameters; a disc where `inner` is left out."""

    at: Place
    normal: tuple[float, ...]
    outer: Annotated[float, Quantity("length", "m", above=0)]
    inner: Annotated[float, Quantity("length", "m", least=0)] = 0.0


@dataclass(frozen=True)
class PlaneDescription:
    """All outer faces in the plane through `at` at right angles to `normal`."""

    at: Place
    normal: tuple[float, ...]


@dataclass(frozen=True)
class PatchPartDescription:
    """A place on outer faces: a rectangle by its centre, directions and sides, or one of `surface` and `nodes` (names in the
    mesh file), `cylinder`, `ring` and `plane`."""

    centre: Place = ()
    along: tuple[float, ...] = ()
    across: tuple[float, ...] = ()
    length: Annotated[float, Quantity("length", "m", above=0)] | None = None
    width: Annotated[float, Quantity("length", "m", above=0)] | None = None
    surface: str = ""
    nodes: str = ""
    cylinder: CylinderDescription | None = None
    ring: RingDescription | None = None
    plane: PlaneDescription | None = None

    @property
    def place(self) -> SolidPlace:
        """The place, where a rectangle is drawn at position 0. Raises ToolpointError for none and for several at once."""
        kinds = [key for key in (*_WAYS_OF_PLACE, "together") if getattr(self, key, None)]
        is_rectangle = any(_is_given(getattr(self, key)) for key in _RECTANGLE_KEYS)
        if len(kinds) + is_rectangle != 1:
            fail("interface", f"{' and '.join([*kinds, *['a rectangle'] * is_rectangle]) or 'no place'}",
                 f"must be one of {', '.join(_WAYS_OF_PLACE)}, together, or a rectangle ({', '.join(_RECTANGLE_KEYS)})",
                 remedy="several places that hold on as one stand under together" if kinds else "")
        return self._rectangle if is_rectangle else self._region(kinds[0])

    @property
    def _rectangle(self) -> Patch:
        for name in _RECTANGLE_KEYS:
            if not _is_given(getattr(self, name)):
                fail(name, "missing", f"must be given: a rectangle has {', '.join(_RECTANGLE_KEYS)}")
        assert self.length is not None and self.width is not None
        from toolpoint.bodies.solid import Patch

        return Patch(_three("centre", self.centre), _three("along", self.along), _three("across", self.across), self.length,
                     self.width)

    def _region(self, kind: str) -> SolidPlace:
        from toolpoint.bodies.solid import CylinderFaces, NamedNodes, NamedSurface, PlaneFaces, RingFaces

        if kind == "surface":
            return NamedSurface(self.surface)
        if kind == "nodes":
            return NamedNodes(self.nodes)
        if self.cylinder is not None:
            part = self.cylinder
            return CylinderFaces(_three("cylinder.at", part.at), _three("cylinder.axis", part.axis), part.diameter, part.length)
        if self.ring is not None:
            return RingFaces(_three("ring.at", self.ring.at), _three("ring.normal", self.ring.normal), self.ring.outer,
                             self.ring.inner)
        assert self.plane is not None
        return PlaneFaces(_three("plane.at", self.plane.at), _three("plane.normal", self.plane.normal))


@dataclass(frozen=True)
class PatchDescription(PatchPartDescription):
    """A place where a joint, a load or a sensor holds on: one, or several `together`.

    Of a rectangle, `along` and `across` are directions of its sides; with `slide` (first and last position along `along`, 0
    where it is drawn) a joint may move over the body: a carriage on its rail, a limb through its frame. Responses are kept at
    `stations` so far apart, half its length where left out.
    """

    slide: tuple[Length, ...] = ()
    stations: Annotated[float, Quantity("length", "m", above=0)] | None = None
    together: tuple[PatchPartDescription, ...] = ()

    @property
    def place(self) -> SolidPlace:
        """The place at position 0. Raises ToolpointError for a slide that is no pair, or of what is no rectangle."""
        place = super().place
        if len(self.slide) not in (0, 2):
            fail("slide", f"{len(self.slide)} positions", "must be two: first and last")
        if self.slide and not self.slide[0] < self.slide[1]:
            fail("slide", f"{self.slide[0]:g} .. {self.slide[1]:g} m", "must run from the lower position to the higher one")
        if self.slide and not _is_given(self.centre):
            fail("slide", "on a place that is no rectangle", "must be of a rectangle",
                 remedy="give centre, along, across, length and width of the carriage's footprint")
        return place

    def _region(self, kind: str) -> SolidPlace:
        if kind != "together":
            return super()._region(kind)
        from toolpoint.bodies.solid import JoinedPlaces

        return JoinedPlaces(tuple(within(f"together[{i}]", attrgetter("place"), part)
                                  for i, part in enumerate(self.together)))


def _is_given(value: tuple[float, ...] | float | None) -> bool:
    return value is not None and np.size(value) > 0


def _three(name: str, values: tuple[float, ...]) -> FloatArray:
    if len(values) != 3:
        fail(name, f"{len(values)} numbers", "must be three")
    return np.array(values, dtype=float)


@dataclass(frozen=True)
class ElasticDescription:
    """A body by finite elements: boxes and windows, or cylinders and bores about one axis, meshed with elements of at most
    `mesh_size`, reduced for `band`.

    `band` is the frequency up to which the machine is asked for; `size` the number of elastic
    coordinates, as many as the interfaces ask for where left out.
    """

    boxes: tuple[CastingBox, ...]
    interfaces: Mapping[str, PatchDescription]
    band: Annotated[float, Quantity("frequency", "Hz", above=0)]
    mesh_size: Annotated[float, Quantity("length", "m", above=0)]
    materials: Mapping[str, ElasticMaterial] = field(default_factory=dict)
    size: int | None = None

    def __post_init__(self) -> None:
        sets = {box.material for box in self.boxes if not box.window}
        if "body" in sets and "body" not in self.materials:
            object.__setattr__(self, "materials", {"body": CAST_IRON, **self.materials})

    @property
    def numbers(self) -> dict[str, ElasticNumbers]:
        """Modulus, density and loss factor of every set that has boxes."""
        sets = dict.fromkeys(box.material for box in self.boxes if not box.window)
        return _numbers({name: self.materials[name] for name in sets if name in self.materials})

    @property
    def frozen_text(self) -> str:
        """Everything but these numbers: bodies with the same text differ by scales alone."""
        return repr(replace(self, materials=_plain(self.materials)))

    @property
    def casting(self) -> Casting | RoundCasting:
        """The casting; boxes without a material of their own are of cast iron."""
        for box in self.boxes:
            if len(box.low) != 3 or len(box.high) != 3:
                fail("boxes", f"{len(box.low)} and {len(box.high)} numbers", "must be three each: low and high corner")
        if any(box.round for box in self.boxes):
            return _round_casting(self.boxes, _materials(self.materials))
        from toolpoint.bodies.solid import Casting, Cuboid

        boxes = tuple(Cuboid(np.array(b.low), np.array(b.high), b.material, b.window) for b in self.boxes)
        return Casting(boxes, _materials(self.materials))

    @property
    def model(self) -> SolidModel:
        """The finite-element model in the body's frame."""
        return self.casting.meshed(self.mesh_size)


def _round_casting(boxes: tuple[CastingBox, ...], materials: dict[str, Material]) -> RoundCasting:
    """Return cylinders and bores about one axis."""
    from toolpoint.bodies.solid import RoundCasting, RoundPart

    axis = next(box.round for box in boxes if box.round)
    along = "xyz".index(axis)
    first, second = (k for k in range(3) if k != along)
    parts, middle = [], (np.array(boxes[0].low) + np.array(boxes[0].high)) / 2
    for i, box in enumerate(boxes):
        if box.round != axis:
            fail(f"boxes[{i}].round", repr(box.round), f"must be {axis!r} as of the others",
                 remedy="a casting is of boxes, or of cylinders about one axis; join others as bodies fixed to it")
        size, centre = np.array(box.high) - np.array(box.low), (np.array(box.low) + np.array(box.high)) / 2
        if abs(size[first] - size[second]) > 1e-9 * size[first]:
            fail(f"boxes[{i}]", f"{size[first]:g} by {size[second]:g} m across {axis}", "must be square, a cylinder fits in it")
        if np.abs(centre - middle)[[first, second]].max() > 1e-9 * size[first]:
            fail(f"boxes[{i}]", f"centre {centre.tolist()}", f"must be on the axis of the first, {middle.tolist()}")
        parts.append(RoundPart(box.low[along], box.high[along], float(size[first]), box.material, box.window))
    return RoundCasting(tuple(parts), axis, (float(middle[0]), float(middle[1]), float(middle[2])), materials)


@dataclass(frozen=True)
class SolidDescription:
    """A body by finite elements from a `file` beside the machine file: a STEP solid, meshed with elements of at most
    `mesh_size`, or a mesh (.inp, .cdb, .bdf, .nas, .dat) of tetrahedra or hexahedra.

    `unit` is that of the file's lengths: a mesh does not say it, so it must be given; a STEP file says it. `materials` are by
    set, the file's own where left out; `body` is that of a STEP solid, cast iron where left out. `band` and `size` as of a
    casting. `held` names a node set of a mesh whose nodes move as one rigid piece: it is an interface too, ``held``.
    """

    file: str
    interfaces: Mapping[str, PatchDescription]
    band: Annotated[float, Quantity("frequency", "Hz", above=0)]
    mesh_size: Annotated[float, Quantity("length", "m", above=0)] | None = None
    unit: Literal["", "m", "mm", "cm", "in"] = ""
    materials: Mapping[str, ElasticMaterial] = field(default_factory=dict)
    size: int | None = None
    held: str = ""


@dataclass(frozen=True)
class SolidContent:
    """Nodes and elements of a solid's file, in m, whatever their material, and what was said when they were read."""

    model: SolidModel
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class SolidBody(SolidDescription):
    """A described solid with its mesh and the digest of that; two are equal where descriptions and digests are."""

    digest: str = ""
    content: SolidContent | None = field(default=None, compare=False, repr=False)

    @property
    def numbers(self) -> dict[str, ElasticNumbers]:
        """Modulus, density and loss factor of every set."""
        return _numbers(self.materials)

    @property
    def frozen_text(self) -> str:
        """Everything but these numbers."""
        return repr(replace(self, materials=_plain(self.materials)))

    @property
    def model(self) -> SolidModel:
        """The finite-element model in the body's frame."""
        assert self.content is not None
        return replace(self.content.model, materials=_materials(self.materials))


def _numbers(materials: Mapping[str, ElasticMaterial]) -> dict[str, ElasticNumbers]:
    from toolpoint.bodies.reduced import ElasticNumbers

    return {name: ElasticNumbers(m.modulus, m.density, m.loss_factor) for name, m in materials.items()}


def _plain(materials: Mapping[str, ElasticMaterial]) -> dict[str, ElasticMaterial]:
    return {name: replace(material, modulus=1.0, density=1.0, loss_factor=0.0) for name, material in materials.items()}


def _materials(materials: Mapping[str, ElasticMaterial]) -> dict[str, Material]:
    from toolpoint.bodies.solid import Material

    return {name: Material(m.modulus, m.poisson, m.density, m.loss_factor) for name, m in materials.items()}
