"""The description of a body by matrices of another finite-element program: files, units, interfaces over its points."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Literal

from toolpoint._quantity import Quantity

if TYPE_CHECKING:  # what reads and solves matrices loads where a body has some
    from toolpoint.bodies.imported import ImportedMatrices

Units = Literal["m-kg-s", "mm-t-s"]


@dataclass(frozen=True)
class PointGroupDescription:
    """Points that an interface holds on to as one, and its place; the mean of the points where left out."""

    points: tuple[str | int, ...]
    at: tuple[Annotated[float, Quantity("length", "m")], ...] = ()


@dataclass(frozen=True)
class MatricesDescription:
    """Stiffness and mass of a free body as another program wrote them (`file`, and `mass_file` where the mass stands apart).

    `geometry` holds the places of the points, as a table (point, x, y, z) or a mesh; left out where `file` is bulk data with
    grid points of its own; `units` are those of all these files;
    `interfaces` are groups of points where joints, loads and points hold on; `band` is the frequency up to which the machine is
    asked for; `size` the number of elastic coordinates, as many as the interfaces ask for where left out.
    """

    file: str
    interfaces: Mapping[str, PointGroupDescription]
    band: Annotated[float, Quantity("frequency", "Hz", above=0)]
    geometry: str = ""
    mass_file: str = ""
    units: Units = "m-kg-s"
    size: int | None = None


@dataclass(frozen=True)
class MatricesBody:
    """A description with what its files hold; two are equal where their descriptions are."""

    description: MatricesDescription
    content: ImportedMatrices = field(compare=False, repr=False)

    @property
    def band(self) -> float:
        """Frequency up to which the machine is asked for, Hz."""
        return self.description.band
