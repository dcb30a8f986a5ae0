"""Plant: motors, mechanics of the axes and the machine's structure as one linear system with its nonlinear scalars."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from toolpoint._check import FloatArray, fail, frozen, suggestion
from toolpoint._notebook import NotebookText
from toolpoint.drives.axis.mechanics import Mechanics
from toolpoint.drives.axis.motor import SynchronousMotor, TorqueMotor
from toolpoint.drives.axis.outputs import OUTPUTS
from toolpoint.drives.friction.records import CONTACT, LAW
from toolpoint.vibration import Dof, Modes, StateSpace
from toolpoint.vibration.state_space import modal


@dataclass(frozen=True)
class DriveAxis:
    """One axis: name, motor, mechanics.

    Examples
    --------
    >>> from toolpoint.drives import TorqueMotor, rigid_axis
    >>> DriveAxis("X", TorqueMotor(), rigid_axis(0.005, 2e-3)).name
    'X'
    """

    name: str
    motor: SynchronousMotor | TorqueMotor
    mechanics: Mechanics


@dataclass(frozen=True)
class Attachment:
    """Names in a structure's StateSpace for one boundary: force input, displacement output, velocity output."""

    force: str
    displacement: str
    velocity: str


@dataclass(frozen=True)
class Structure:
    """Machine structure that the axes push against.

    Parameters
    ----------
    system : StateSpace
        Continuous, without feed-through at the named outputs.
    boundaries : mapping
        ``"axis.boundary"`` -> Attachment.
    tool : mapping
        Axis name -> output with the displacement of the tool along the axis (subtracted from the table's).

    Examples
    --------
    >>> from toolpoint.vibration import Modes
    >>> bed = Structure.from_modes(Modes([40.0], [0.02], [[0.03]], [Dof("guide", "+x")]), {"X.base": "guide:+x"})
    >>> bed.boundaries["X.base"].force
    'guide:+x'
    """

    system: StateSpace
    boundaries: Mapping[str, Attachment]
    tool: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.system.sample_time is not None or np.any(self.system.d):
            fail("Structure.system", repr(self.system), "must be continuous and without feed-through D")
        for attachment in self.boundaries.values():
            self.column(attachment.force)
            self.row(attachment.displacement)
            self.row(attachment.velocity)
        for name in self.tool.values():
            self.row(name)

    @classmethod
    def from_modes(cls, modes: Modes, boundaries: Mapping[str, Dof | str], tool: Mapping[str, Dof | str] | None = None
                   ) -> Structure:
        """Return the structure of real modes; `boundaries` and `tool` name Dofs of the modes."""
        tool = {} if tool is None else tool
        places = list(dict.fromkeys(str(d) for d in (*boundaries.values(), *tool.values())))
        system = modal(modes, list(dict.fromkeys(str(d) for d in boundaries.values())), places,
                       kind="displacement and velocity")
        attach = {key: Attachment(str(d), str(d), "d" + str(d)) for key, d in boundaries.items()}
        return cls(system, attach, {key: str(d) for key, d in tool.items()})

    def column(self, name: str) -> FloatArray:
        """Return the column of B of an input."""
        return self.system.b[:, _at("input", name, self.system.inputs)]

    def row(self, name: str) -> FloatArray:
        """Return the row of C of an output."""
        return self.system.c[_at("output", name, self.system.outputs)]


def _at(kind: str, name: str, names: Sequence[str]) -> int:
    if name not in names:
        fail(f"Structure {kind}", repr(name), "must be one of " + ", ".join(names[:12]))
    return list(names).index(name)


@dataclass(frozen=True, eq=False)
class Plant(NotebookText):
    r"""Linear plant with nonlinear scalars: :math:`\dot x = A x + B_u u + B_d d + B_w w(s)`, s = S x, y = C x.

    u holds (u_d, u_q) of every axis, V (0 and torque for a TorqueMotor); d the force on every table, N; w the friction,
    contact and bilinear terms (the viscous part of friction is in A). Outputs of every axis: motor angle and speed,
    scale, i_d, i_q, table, table against tool. `laws` are the records (`friction.records.LAW`) of the friction and contact
    laws, `viscous` their viscous parts, `products` the pairs of scalars whose products are the bilinear terms; `loads`
    (n_laws, n_states) the forces, N, that press the surfaces of laws with a `load_arm`.
    """

    axes: tuple[DriveAxis, ...]
    a: FloatArray
    b_input: FloatArray
    b_force: FloatArray
    b_scalar: FloatArray
    scalars: FloatArray
    outputs: FloatArray
    laws: np.ndarray
    viscous: FloatArray
    products: np.ndarray
    loads: FloatArray
    states: tuple[str, ...]

    def output(self, axis: int | str, name: str) -> FloatArray:
        """Return the row of C of one output of one axis."""
        i = axis if isinstance(axis, int) else [a.name for a in self.axes].index(axis)
        return self.outputs[len(OUTPUTS) * i + OUTPUTS.index(name)]

    @property
    def linear(self) -> StateSpace:
        """Linear part without friction and bilinear terms."""
        d = np.zeros((self.outputs.shape[0], self.b_input.shape[1] + self.b_force.shape[1]))
        names = [a.name for a in self.axes]
        return StateSpace(self.a, np.hstack([self.b_input, self.b_force]), self.outputs, d,
                          (*(f"{n}.{u}" for n in names for u in ("u_d", "u_q")), *(f"{n}.force" for n in names)),
                          tuple(f"{n}.{o}" for n in names for o in OUTPUTS), self.states)

    def __repr__(self) -> str:
        return (f"Plant({', '.join(a.name for a in self.axes)}; {self.a.shape[0]} states, {self.laws.size} friction "
                f"and contact laws, {self.products.shape[0]} bilinear terms)")


def build_plant(axes: Sequence[DriveAxis], structure: Structure | None = None) -> Plant:
    """Return the plant of several axes on one structure (on ground where none is given or a boundary is not served).

    A boundary coordinate takes the displacement and velocity of its attachment and gives back the force of the springs,
    dampers and friction that end on it: drive forces and reactions are equal and opposite.

    Examples
    --------
    >>> from toolpoint.drives import TorqueMotor, rigid_axis
    >>> build_plant([DriveAxis("X", TorqueMotor(), rigid_axis(0.005, 2e-3))])
    Plant(X; 2 states, 0 friction and contact laws, 0 bilinear terms)
    """
    axes = tuple(axes)
    names = [a.name for a in axes]
    if len(set(names)) != len(names) or not axes:
        fail("axes", repr(names), "must be at least one axis, each with its own name")
    if structure is not None:
        _check_names("boundaries", structure.boundaries, [f"{a.name}.{b}" for a in axes for b in a.mechanics.boundaries])
        _check_names("tool", structure.tool, names)
    return _Assembly(axes, structure).build()


def _check_names(what: str, names: Mapping[str, object], allowed: Sequence[str]) -> None:
    for key in names:
        if key not in allowed:
            fail(f"Structure.{what}", repr(key), "must be one of " + ", ".join(allowed), remedy=suggestion(key, allowed))


class _Assembly:
    """State offsets and columns of a plant during its assembly."""

    def __init__(self, axes: tuple[DriveAxis, ...], structure: Structure | None) -> None:
        self.axes, self.structure = axes, structure
        self.start: list[tuple[int, int]] = []
        offset, states = 0, []
        for axis in axes:
            electrical = isinstance(axis.motor, SynchronousMotor)
            self.start.append((offset, offset + 2 * electrical))
            free = axis.mechanics.free
            states += [f"{axis.name}.i_d", f"{axis.name}.i_q"] if electrical else []
            states += [f"{axis.name}.{q}" for q in free] + [f"{axis.name}.d{q}" for q in free]
            offset += 2 * electrical + 2 * len(free)
        self.at_structure = offset
        n = offset + (structure.system.size if structure else 0)
        self.states = (*states, *(structure.system.states if structure else ()))
        self.a = np.zeros((n, n))
        if structure:
            self.a[offset:, offset:] = structure.system.a
        self.b_input, self.b_force = np.zeros((n, 2 * len(axes))), np.zeros((n, len(axes)))
        self.columns: list[FloatArray] = []
        self.laws: list[np.ndarray] = []
        self.viscous: list[float] = []
        self.loads: list[FloatArray] = []
        self.scalars: list[FloatArray] = []
        self.bilinear: list[FloatArray] = []
        self.factors: list[tuple[FloatArray, FloatArray]] = []

    def build(self) -> Plant:
        outputs = [row for i in range(len(self.axes)) for row in self._axis(i)]
        scalars = list(self.scalars)
        products = np.zeros((len(self.factors), 2), np.int64)
        first = len(scalars)
        for k, pair in enumerate(self.factors):
            for side, factor in enumerate(pair):
                # Every scalar is an unknown of the implicit step: products that share a factor share its scalar.
                equal = [i for i in range(first, len(scalars)) if np.array_equal(scalars[i], factor)]
                products[k, side] = equal[0] if equal else len(scalars)
                scalars += [] if equal else [factor]
        n = self.a.shape[0]
        stacked = lambda parts, width: np.array(parts).reshape(-1, width)
        laws = np.stack(self.laws) if self.laws else np.zeros(0, LAW)
        return Plant(self.axes, frozen(self.a), frozen(self.b_input), frozen(self.b_force),
                     frozen(stacked(self.columns + self.bilinear, n).T.copy()), frozen(stacked(scalars, n)),
                     frozen(np.array(outputs)), frozen(laws), frozen(np.array(self.viscous)), products,
                     frozen(stacked(self.loads, n)), self.states)

    def _rows(self, i: int) -> tuple[FloatArray, FloatArray]:
        """Return displacement and velocity of all coordinates (free and boundary) as rows over the states."""
        mechanics, n = self.axes[i].mechanics, self.a.shape[0]
        offset, free = self.start[i][1], mechanics.free
        place, rate = np.zeros((len(mechanics.coordinates), n)), np.zeros((len(mechanics.coordinates), n))
        for row, name in enumerate(mechanics.coordinates):
            if name in free:
                place[row, offset + free.index(name)] = rate[row, offset + len(free) + free.index(name)] = 1.0
            elif (served := self._served(i, name)) is not None and self.structure is not None:
                place[row, self.at_structure:] = self.structure.row(served.displacement)
                rate[row, self.at_structure:] = self.structure.row(served.velocity)
        return place, rate

    def _served(self, i: int, name: str) -> Attachment | None:
        return self.structure.boundaries.get(f"{self.axes[i].name}.{name}") if self.structure else None

    def _push(self, i: int, force: FloatArray) -> FloatArray:
        """Return the state derivative that forces on all coordinates cause; shape (n_coordinates, ...) -> (n, ...)."""
        mechanics, offset = self.axes[i].mechanics, self.start[i][1]
        free = [k for k, name in enumerate(mechanics.coordinates) if name in mechanics.free]
        out = np.zeros((self.a.shape[0], *force.shape[1:]))
        # Boundary coordinates have no mass here: their forces act on the structure, which brings its own.
        out[offset + len(free):offset + 2 * len(free)] = np.linalg.solve(mechanics.mass[np.ix_(free, free)], force[free])
        for k, name in enumerate(mechanics.coordinates):
            served = self._served(i, name)
            if served is not None and self.structure is not None:
                out[self.at_structure:] += np.multiply.outer(self.structure.column(served.force), force[k])
        return out

    def _axis(self, i: int) -> list[FloatArray]:
        axis, (motor_offset, offset) = self.axes[i], self.start[i]
        mechanics, size = axis.mechanics, len(axis.mechanics.free)
        place, rate = self._rows(i)
        self.a[offset:offset + size, offset + size:offset + 2 * size] = np.eye(size)
        self.a += self._push(i, -(mechanics.stiffness @ place + mechanics.damping @ rate))
        motor, table = mechanics.vector(mechanics.motor), mechanics.vector(mechanics.table)
        for rub in mechanics.friction:
            law, load = rub.law.record, np.zeros(self.a.shape[0])
            if rub.load is not None:
                law["load_arm"], load = rub.load_arm, mechanics.vector(rub.load) @ place
            self._law(i, rub.row, law, rate, -1.0)
            self.loads.append(load)
        for play in mechanics.contacts:
            self._law(i, play.row, play.law.record, place, 1.0)
            self.loads.append(np.zeros(self.a.shape[0]))
        speed = motor @ rate
        currents = np.zeros((2, self.a.shape[0]))
        torque = self._push(i, motor)
        if isinstance(axis.motor, SynchronousMotor):
            currents[0, motor_offset] = currents[1, motor_offset + 1] = 1.0
            self._electrical(i, axis.motor, motor_offset, speed, torque, currents)
        else:
            self.b_input[:, 2 * i + 1] = torque
        self.b_force[:, i] = self._push(i, table)
        scale, position = mechanics.vector(mechanics.scale) @ place, table @ place
        tool = position.copy()
        # The machine yields too: at the cut the table's position against the tool counts.
        if self.structure and axis.name in self.structure.tool:
            tool[self.at_structure:] -= self.structure.row(self.structure.tool[axis.name])
        return [motor @ place, speed, scale, *currents, position, tool]

    def _law(self, i: int, row: Mapping[str, float], law: np.ndarray, motion: FloatArray, sign: float) -> None:
        vector = self.axes[i].mechanics.vector(row)
        column = sign * self._push(i, vector)
        viscous = 0.0
        if law["kind"] != CONTACT:
            # Viscous friction is linear: it stands in A, and the law keeps its dry part.
            law = law.copy()
            viscous, law["viscous"] = float(law["viscous"]), 0.0
            self.a += viscous * np.outer(column, vector @ motion)
        self.viscous.append(viscous)
        self.laws.append(law)
        self.scalars.append(vector @ motion)
        self.columns.append(column)

    def _electrical(self, i: int, motor: SynchronousMotor, offset: int, speed: FloatArray, torque: FloatArray,
                    currents: FloatArray) -> None:
        p, n = motor.pole_pairs, self.a.shape[0]
        ld, lq = motor.inductance_d, motor.inductance_q
        self.a[offset, offset], self.a[offset + 1, offset + 1] = -motor.resistance / ld, -motor.resistance / lq
        self.a[offset + 1] -= p * motor.flux / lq * speed
        self.a += np.outer(torque, motor.torque_constant * currents[1])
        self.b_input[offset, 2 * i], self.b_input[offset + 1, 2 * i + 1] = 1 / ld, 1 / lq
        # Speed times current is no linear term: these products stay out of A.
        unit = np.eye(n)
        terms = [(p * lq / ld * unit[offset], speed, currents[1]), (-p * ld / lq * unit[offset + 1], speed, currents[0])]
        # Reluctance torque of a motor with salient poles.
        if ld != lq:
            terms.append((1.5 * p * (ld - lq) * torque, currents[0], currents[1]))
        for column, *pair in terms:
            self.bilinear.append(column)
            self.factors.append((pair[0], pair[1]))
