"""Body: mass, damping and stiffness in the body's own frame, with the interfaces where joints and points hold on.

A body's coordinates are the six of its frame, the twist (v, w) in its own axes, then its modal coordinates, if any.
A rigid body has no modal coordinates; a reduced elastic one brings them with the motion they give to each interface.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from toolpoint._check import LEFT_OUT, FloatArray, fail, floats, positive, symmetric
from toolpoint._notebook import NotebookText
from toolpoint.bodies.inertia import MassProperties
from toolpoint.bodies.residual_form import ResidualForm
from toolpoint.bodies.surface import BodySurface
from toolpoint.spatial.motion_table import MotionTable


@dataclass(frozen=True, eq=False)
class Interface:
    """Place on a body where a joint, a load or a sensor holds on.

    Parameters
    ----------
    position : (3,) floats
        In the body's frame, m.
    participation : (6, n_modal) floats, optional
        Twist (v, w) of the place, in the body's axes and about the place, per modal coordinate; none for a rigid body.
    slide : MotionTable, optional
        In place of `participation` where the place slides along the body: `position` is then the one at 0 of the table.
    along : (3,) floats, optional
        Direction of the slide, in the body's axes.

    Raises
    ------
    ToolpointError
        For a slide without direction, or beside a participation.

    Examples
    --------
    >>> from toolpoint.bodies import Interface
    >>> Interface([0.1, 0.0, 0.25]).position.tolist()
    [0.1, 0.0, 0.25]
    """

    position: FloatArray
    participation: FloatArray | None = None
    slide: MotionTable | None = None
    along: FloatArray | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", floats("Interface.position", self.position, (3,)))
        if self.participation is not None:
            object.__setattr__(self, "participation", floats("Interface.participation", self.participation, (6, None)))
        if (self.slide is None) != (self.along is None) or (self.slide is not None and self.participation is not None):
            fail("Interface.slide", "without `along`, or beside `participation`", "must have its direction, and stand alone")
        if self.along is not None:
            along = floats("Interface.along", self.along, (3,))
            object.__setattr__(self, "along", along / positive("length of Interface.along", float(np.linalg.norm(along))))

    def slid_to(self, place: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return positions (P, 3) on the body and participation (P, 6, n_modal) where places (P, 3) of the body are nearest.

        Raises ToolpointError where a place is beyond the table of the slide.
        """
        assert self.slide is not None and self.along is not None
        travel = (place - self.position) @ self.along
        return self.position + travel[:, None] * self.along, self.slide.at(travel)


@dataclass(frozen=True, eq=False)
class Body(NotebookText):
    """Rigid or reduced elastic body in its own frame.

    Parameters
    ----------
    mass : (6 + n_modal, 6 + n_modal) floats
        Symmetric, about the frame's origin.
    stiffness, damping : (n_modal, n_modal) floats, optional
        Of the modal coordinates.
    interfaces : mapping of name to Interface
    notes : sequence of str
        Limits of a reduced body: its band, and the modes left out.
    gyroscopic : (6 + n_modal, 6 + n_modal) floats, optional
        Skew, per rad/s of spin about `spin_axis` (3,) of the body's frame; for elastic bodies of revolution.
    structural_damping : (n_modal, n_modal) floats, optional
        Imaginary part of the complex stiffness, from the loss factors of its materials.
    surface : BodySurface, optional
        Nodes and triangles for drawing.
    residual : ResidualForm, optional
        Form that gives the error of a machine's modes by the reduction; without it the error is not stated.
    mesh_energy : (n_modal, n_modal) floats, optional
        Energy of the error of the body's mesh in its modal coordinates, as a quadratic form, J; None: not known.

    Raises
    ------
    ToolpointError
        For wrong shapes, matrices that are not symmetric, or a gyroscopic matrix that is not skew.

    Examples
    --------
    >>> import numpy as np
    >>> from toolpoint.bodies import Body, MassProperties
    >>> Body.rigid(MassProperties(120.0, np.zeros(3), np.diag([2.0, 3.0, 4.0])))
    Body(rigid, mass 120 kg, 0 interfaces)
    """

    mass: FloatArray
    stiffness: FloatArray = LEFT_OUT
    damping: FloatArray = LEFT_OUT
    interfaces: Mapping[str, Interface] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    gyroscopic: FloatArray | None = None
    spin_axis: FloatArray | None = None
    structural_damping: FloatArray = LEFT_OUT
    surface: BodySurface | None = None
    residual: ResidualForm | None = None
    mesh_energy: FloatArray | None = None

    def __post_init__(self) -> None:
        put = object.__setattr__
        mass = symmetric("Body.mass", floats("Body.mass", self.mass, (None, None)))
        modal = mass.shape[-1] - 6
        if modal < 0:
            fail("Body.mass", f"shape {mass.shape}", "must be at least (6, 6)")
        put(self, "mass", mass)
        zero = np.zeros((modal, modal))
        for name in ("stiffness", "damping", "structural_damping"):
            value = getattr(self, name)
            put(self, name, symmetric(f"Body.{name}", floats(f"Body.{name}", zero if value is None else value,
                                                             (modal, modal))))
        if self.mesh_energy is not None:
            put(self, "mesh_energy", symmetric("Body.mesh_energy",
                                               floats("Body.mesh_energy", self.mesh_energy, (modal, modal))))
        for name, place in self.interfaces.items():
            if place.slide is not None and place.slide.values.shape[2] != modal:
                fail(f"Body.interfaces[{name!r}]", f"{place.slide.values.shape[2]} modal columns", f"must be {modal}")
            if place.participation is not None and place.participation.shape[1] != modal:
                fail(f"Body.interfaces[{name!r}]", f"{place.participation.shape[1]} modal columns", f"must be {modal}")
        put(self, "interfaces", dict(self.interfaces))
        if self.surface is not None and self.surface.motion.shape[2] != modal:
            fail("Body.surface", f"{self.surface.motion.shape[2]} modal columns", f"must be {modal}")
        if (self.gyroscopic is None) != (self.spin_axis is None):
            fail("Body.gyroscopic", "given without spin_axis, or the other way round", "must have both or neither")
        if self.gyroscopic is not None and self.spin_axis is not None:
            matrix = floats("Body.gyroscopic", self.gyroscopic, mass.shape)
            if np.abs(matrix + matrix.T).max() > 1e-12 * np.abs(matrix).max():
                fail("Body.gyroscopic", "a matrix that is not skew", "must be skew: a gyroscopic moment does no work")
            put(self, "gyroscopic", matrix)
            put(self, "spin_axis", floats("Body.spin_axis", self.spin_axis, (3,)))

    @property
    def modal_count(self) -> int:
        """Number of modal coordinates."""
        return int(self.mass.shape[-1]) - 6

    def combined(self, mix: FloatArray) -> Body:
        """Return the body over combinations (n_modal, k) of its modal coordinates."""
        def of_modal(matrix: FloatArray) -> FloatArray:
            return _symmetric_part(mix.T @ matrix @ mix)

        turn = combine_modal(mix)
        interfaces = {name: replace(place, participation=None if place.participation is None else place.participation @ mix,
                                    slide=None if place.slide is None else place.slide.mixed(mix))
                      for name, place in self.interfaces.items()}
        return replace(
            self, mass=_symmetric_part(turn.T @ self.mass @ turn), stiffness=of_modal(self.stiffness),
            damping=of_modal(self.damping), structural_damping=of_modal(self.structural_damping), interfaces=interfaces,
            gyroscopic=None if self.gyroscopic is None else turn.T @ self.gyroscopic @ turn,
            surface=None if self.surface is None else replace(self.surface, motion=self.surface.motion @ mix),
            residual=None if self.residual is None else self.residual.combined(mix),
            mesh_energy=None if self.mesh_energy is None else of_modal(self.mesh_energy))

    @classmethod
    def rigid(cls, properties: MassProperties) -> Body:
        """Return a rigid body with these mass properties."""
        return cls(properties.spatial)

    def participation(self, interface: str | None) -> FloatArray:
        """Return the participation of an interface, shape (6, n_modal), zero for a rigid body.

        On an elastic body every joint, load and point must name an interface: only there is its motion known.
        """
        if self.modal_count == 0:
            return np.zeros((6, 0))
        if interface is None or interface not in self.interfaces:
            names = ", ".join(self.interfaces) or "none"
            fail("interface", repr(interface), f"an elastic body needs one of its interfaces ({names})")
        if self.interfaces[interface].slide is not None:
            fail("interface", repr(interface), "slides: it can be held by a joint only",
                 remedy="a joint's place says where it is")
        value = self.interfaces[interface].participation
        return np.zeros((6, self.modal_count)) if value is None else value

    def __repr__(self) -> str:
        kind = "rigid" if self.modal_count == 0 else f"{self.modal_count} modal coordinates"
        return f"Body({kind}, mass {self.mass[0, 0]:.6g} kg, {len(self.interfaces)} interfaces)"


def combine_modal(mix: FloatArray) -> FloatArray:
    """Return the map (6 + r, 6 + k) from a body's coordinates with combinations (r, k) of its modal ones to those before."""
    turn = np.zeros((6 + mix.shape[0], 6 + mix.shape[1]))
    turn[:6, :6], turn[6:, 6:] = np.eye(6), mix
    return turn


def _symmetric_part(matrix: FloatArray) -> FloatArray:
    return (matrix + matrix.T) / 2
