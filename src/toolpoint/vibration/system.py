"""SecondOrderSystem: mass, damping and stiffness with labelled inputs and outputs, at one pose or many."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import LEFT_OUT, ComplexArray, FloatArray, fail, floats, symmetric
from toolpoint._notebook import NotebookText
from toolpoint.vibration.dof import Dof, check_labels, positions, summary


@dataclass(frozen=True, eq=False)
class SecondOrderSystem(NotebookText):
    r"""Linear equations of motion :math:`M \ddot q + C \dot q + (K + i D) q = B f`, :math:`y = L q`.

    Parameters
    ----------
    mass, stiffness : (..., n, n) floats
        Symmetric; SI for metre and radian coordinates. Leading axes are poses.
    damping : (..., n, n) floats, optional
        Viscous damping (a skew part is a gyroscopic term); zero where left out.
    structural_damping : (..., n, n) floats, optional
        Imaginary part D of the complex stiffness, N/m (frequency domain only); zero where left out.
    output_map : (..., n_outputs, n), optional
        Displacement of every output per coordinate; the identity where left out.
    input_map : (..., n, n_inputs), optional
        Generalised force per input; the transposed output map where left out (forces at the outputs).
    outputs, inputs : sequences of Dof, optional
        Labels; points 1 .. n with direction +x where left out.
    coordinates : sequence of str, optional
        Names of the coordinates, for messages.
    notes : sequence of str
        Doubts and remarks.

    Raises
    ------
    ToolpointError
        For wrong shapes, values that are not finite, an unsymmetric mass or stiffness, or a mass matrix that is not
        positive semidefinite.

    Examples
    --------
    >>> from toolpoint.vibration import SecondOrderSystem
    >>> SecondOrderSystem(mass=[[2.0, 0.0], [0.0, 1.0]], stiffness=[[3e6, -1e6], [-1e6, 1e6]])
    SecondOrderSystem(2 coordinates, 2 outputs, 2 inputs, no damping)
    """

    mass: FloatArray
    stiffness: FloatArray
    damping: FloatArray | None = None
    structural_damping: FloatArray | None = None
    output_map: FloatArray = LEFT_OUT
    input_map: FloatArray = LEFT_OUT
    outputs: tuple[Dof, ...] = ()
    inputs: tuple[Dof, ...] = ()
    coordinates: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        put = object.__setattr__
        mass = symmetric("SecondOrderSystem.mass", floats("SecondOrderSystem.mass", self.mass, (None, None)))
        n = mass.shape[-1]
        put(self, "mass", mass)
        put(self, "stiffness", symmetric("SecondOrderSystem.stiffness",
                                         floats("SecondOrderSystem.stiffness", self.stiffness, (n, n))))
        for name in ("damping", "structural_damping"):
            value = getattr(self, name)
            if value is not None:
                put(self, name, floats(f"SecondOrderSystem.{name}", value, (n, n)))
        self._check_mass()
        self._check_maps(n)
        names = tuple(self.coordinates) or tuple(f"q{i + 1}" for i in range(n))
        if len(names) != n:
            fail("SecondOrderSystem.coordinates", f"{len(names)} names", f"must be {n}")
        put(self, "coordinates", names)
        put(self, "notes", tuple(self.notes))

    def _check_mass(self) -> None:
        if self.mass.size == 0:
            return
        diagonal = np.diagonal(self.mass, axis1=-2, axis2=-1)
        if diagonal.min() < 0:
            coordinate = int(np.argwhere(diagonal.reshape(-1, self.size).min(axis=0) < 0)[0, 0])
            name = self.coordinates[coordinate] if self.coordinates else f"q{coordinate + 1}"
            fail("SecondOrderSystem.mass", f"negative mass {diagonal.min():g} of coordinate {name}",
                 "must be positive semidefinite")

    def _check_maps(self, n: int) -> None:
        put = object.__setattr__
        output_map = np.eye(n) if self.output_map is None else self.output_map
        output_map = floats("SecondOrderSystem.output_map", output_map, (None, n))
        input_map = np.swapaxes(output_map, -1, -2) if self.input_map is None else self.input_map
        input_map = floats("SecondOrderSystem.input_map", input_map, (n, None))
        outputs = self.outputs or tuple(Dof(i + 1, "+x") for i in range(output_map.shape[-2]))
        inputs = self.inputs or (outputs if self.input_map is None else
                                 tuple(Dof(i + 1, "+x") for i in range(input_map.shape[-1])))
        if self.output_map is None and self.outputs and len(self.outputs) != n:
            fail("SecondOrderSystem.outputs", f"{len(self.outputs)} labels for {n} coordinates", "must be one label for each",
                 remedy=f"give output_map of shape ({len(self.outputs)}, {n}): which coordinates each output sees; with inputs "
                        "at the same places input_map may be left out")
        put(self, "output_map", output_map)
        put(self, "input_map", input_map)
        put(self, "outputs", check_labels("SecondOrderSystem.outputs", outputs, output_map.shape[-2]))
        put(self, "inputs", check_labels("SecondOrderSystem.inputs", inputs, input_map.shape[-1]))

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return int(self.mass.shape[-1])

    @property
    def poses(self) -> tuple[int, ...]:
        """Shape of the leading (pose) axes; () for one pose."""
        return np.broadcast_shapes(self.mass.shape[:-2], self.stiffness.shape[:-2])

    def dynamic_stiffness(self, omega: float) -> ComplexArray:
        """Return Z = K + i D + i w C - w^2 M at w (rad/s), shape (..., n, n), complex."""
        z = self.stiffness - omega**2 * self.mass + 0j
        if self.damping is not None:
            z = z + 1j * omega * self.damping
        if self.structural_damping is not None:
            z = z + 1j * self.structural_damping
        return z

    def selected(
        self, outputs: Iterable[Dof | str | int] | None = None, inputs: Iterable[Dof | str | int] | None = None
    ) -> SecondOrderSystem:
        """Return the system seen at these outputs and driven at these inputs."""
        rows = list(range(len(self.outputs))) if outputs is None else positions("outputs", outputs, self.outputs)
        columns = list(range(len(self.inputs))) if inputs is None else positions("inputs", inputs, self.inputs)
        return replace(
            self, output_map=self.output_map[..., rows, :], input_map=self.input_map[..., :, columns],
            outputs=tuple(self.outputs[i] for i in rows), inputs=tuple(self.inputs[i] for i in columns))

    def at_pose(self, index: int) -> SecondOrderSystem:
        """Return the system of one pose of a batch."""
        if not self.poses:
            fail("at_pose", "a single pose", "must be a batch")
        select = (lambda a: a if a is None or a.ndim == 2 else a[index])
        return replace(self, **{name: select(getattr(self, name)) for name in (
            "mass", "stiffness", "damping", "structural_damping", "output_map", "input_map")})

    def with_damping(self, damping: FloatArray | None) -> SecondOrderSystem:
        """Return the system with this viscous damping matrix in place of its own."""
        return replace(self, damping=damping)

    def __repr__(self) -> str:
        poses = f"{'x'.join(map(str, self.poses))} poses, " if self.poses else ""
        kinds = [name for name, value in (("viscous", self.damping), ("structural", self.structural_damping))
                 if value is not None]
        return (f"SecondOrderSystem({poses}{self.size} coordinates, {summary(self.outputs)} outputs, "
                f"{summary(self.inputs)} inputs, {' and '.join(kinds) or 'no'} damping)")
