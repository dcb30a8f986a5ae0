"""The description of one body: frame, shape or mesh, inertia, spin, and what stands for it where it is elastic. SI units.

Body data (centre, inertia, mesh, points) are in the body's frame, which is the machine frame at the reference pose unless
`frame` places it elsewhere.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.machine.description.beam import BeamDescription
from toolpoint.machine.description.elastic import ElasticDescription, SolidBody
from toolpoint.machine.description.matrices import MatricesBody

Vector = tuple[float, float, float]
ORIGIN_VECTOR: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class FrameDescription:
    """Place and orientation of a frame in the machine frame: `at` in m, `rotation` as zyx Euler angles in rad.

    >>> FrameDescription(at=(0.0, 0.0, 0.5))  # half a metre above the origin, not turned
    FrameDescription(at=(0.0, 0.0, 0.5), rotation=(0.0, 0.0, 0.0))
    """

    at: Vector = (0.0, 0.0, 0.0)
    rotation: Vector = (0.0, 0.0, 0.0)


MACHINE_FRAME = FrameDescription()  # of what stands where the machine frame is, unturned


@dataclass(frozen=True)
class ShapeDescription:
    """A uniform shape: ``box`` (size), ``cylinder`` (diameter, length, axis, bore) or ``sphere`` (diameter), in m.

    >>> ring = ShapeDescription("cylinder", diameter=0.2, length=0.5, bore=0.1)
    >>> BodyDescription(density=7850.0, shape=ring).shape.axis  # lies along z where nothing else is said
    'z'
    """

    kind: str
    size: Vector | None = None
    diameter: float | None = None
    length: float | None = None
    axis: str = "z"
    bore: float = 0.0


@dataclass(frozen=True, eq=False)
class MeshDescription:
    """A closed triangle mesh: the STL file's name, and the triangle corners (t, 3, 3) in m that were read from it.

    >>> triangle = MeshDescription("base.stl", np.array([[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]]))
    >>> triangle.corners.shape  # triangles, corners, coordinates
    (1, 3, 3)
    """

    file: str
    corners: FloatArray


@dataclass(frozen=True)
class InertiaDescription:
    """Inertia tensor about the centre of mass, kg m^2; products of inertia with their sign in the tensor.

    >>> InertiaDescription(2.0, 3.0, 4.0, xy=-0.5).tensor.tolist()
    [[2.0, -0.5, 0.0], [-0.5, 3.0, 0.0], [0.0, 0.0, 4.0]]
    """

    xx: float
    yy: float
    zz: float
    xy: float = 0.0
    xz: float = 0.0
    yz: float = 0.0

    @property
    def tensor(self) -> FloatArray:
        """The tensor, shape (3, 3)."""
        return np.array([[self.xx, self.xy, self.xz], [self.xy, self.yy, self.yz], [self.xz, self.yz, self.zz]])


@dataclass(frozen=True)
class SpinDescription:
    """Steady spin of a body that is symmetric about its axis: `speed` in rad/s about `axis` (machine frame, reference pose).

    >>> spindle = BodyDescription(20.0, inertia=InertiaDescription(0.1, 0.1, 0.02), spin=SpinDescription(speed=1256.6))
    >>> round(spindle.spin.speed * 60 / (2 * np.pi))  # rev/min
    12000
    """

    speed: float
    axis: Vector = (0.0, 0.0, 1.0)


ELASTIC_KINDS = ("elastic", "solid", "beam", "matrices")  # keys of a body, one of which makes it elastic
SCALING_KEYS = {"elastic": "materials", "solid": "materials", "beam": "segments"}  # where the listed numbers of such a body are


@dataclass(frozen=True)
class BodyDescription:
    """A body: mass properties given, or from a shape or a mesh and a density; and how it is drawn.

    mass in kg, centre in m, inertia in kg m^2 about the centre; `shape` with `mass` gives the inertia of the
    uniform shape of that mass, `shape` or `mesh` with `density` (kg/m^3) gives all. `draw` is a box size in m.

    >>> table = BodyDescription(300.0, centre=(0.0, 0.0, 0.1), inertia=InertiaDescription(20.0, 20.0, 35.0))
    >>> table.is_elastic
    False
    """

    mass: float | None = None
    centre: Vector = (0.0, 0.0, 0.0)
    inertia: InertiaDescription | None = None
    density: float | None = None
    shape: ShapeDescription | None = None
    mesh: MeshDescription | None = None
    frame: FrameDescription = MACHINE_FRAME
    draw: ShapeDescription | None = None
    draw_at: Vector | None = None
    source: str = ""
    spin: SpinDescription | None = None
    elastic: ElasticDescription | None = None
    beam: BeamDescription | None = None
    matrices: MatricesBody | None = None
    solid: SolidBody | None = None

    @property
    def is_elastic(self) -> bool:
        """Whether finite elements stand for the body."""
        return any(getattr(self, kind) is not None for kind in ELASTIC_KINDS)
