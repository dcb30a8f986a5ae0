"""Study of a whole machine by finite elements: modes, test beside model, sensitivities, and options for the cut."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._doubt import Doubt, mark_notes
from toolpoint._notebook import NotebookText
from toolpoint.bodies.solid.sensitivity import ElementSensitivity
from toolpoint.cutting.description import CuttingDescription
from toolpoint.spatial import transform as tf
from toolpoint.studies.finite_elements.example_mill import (
    FINE_EXAMPLE_MESH_SIZE,
    example_mill,
    example_tested_mill,
    example_variants,
)
from toolpoint.studies.finite_elements.hammer_test import FiniteElementTest, plan_nodes, run_hammer_test
from toolpoint.studies.finite_elements.machine_cut import EXAMPLE_FACE_MILL, response_lines
from toolpoint.studies.finite_elements.machine_options import (
    HEADER,
    FittedDampers,
    MachineOption,
    fit_dampers,
    judge_machine,
    judge_variants,
    option_rows,
)
from toolpoint.studies.finite_elements.material_losses import bound_left_out, question_losses, solve_losses
from toolpoint.studies.finite_elements.nodal_correlation import FiniteElementCorrelation, correlate_finite_elements
from toolpoint.studies.finite_elements.part_sensitivity import PartSensitivity, study_sensitivity
from toolpoint.studies.finite_elements.whole_machine import FiniteElementMachine
from toolpoint.studies.text_table import text_table
from toolpoint.vibration import Dof, Modes
from toolpoint.vibration.correlation import pair_modes
from toolpoint.vibration.sparse import EigenPairs

_NO_PROGRESS: Callable[[str], None] = lambda name: None
# Modes that are studied, and those beyond that a test and slopes of shapes need; the damping ratio of the joints is chosen.
_STUDIED_MODES, _EXTRA_MODES, _JOINT_DAMPING_RATIO = 10, 6, 0.02
# Where the virtual test was drawn: a turn of 87 degrees about z, an origin of its own, places measured to 3 mm; noise of 1 %.
_TEST_TURN, _TEST_ORIGIN, _TEST_PLACE_DEVIATION, _CHANNEL_NOISE, _TEST_POINTS, _STRUCK_DOFS = (
    np.radians(87), (0.3, -0.2, 0.5), 3e-3, 0.01, 24, 3)


@dataclass(frozen=True, eq=False)
class FiniteElementStudy(NotebookText):
    """Results of a finite-element study of a machine.

    machine, pairs; modes : at its points, with damping; joint_shares : of strain energy; finer_frequency : Hz, of a finer mesh,
    empty without; whole_sensitivity, part_sensitivity : of the machine and of one part alone; test, correlation : a virtual
    hammer test of another machine, None without; base, options : the cut on the machine as it is, and on machines with
    something done; dampers.
    """

    machine: FiniteElementMachine
    pairs: EigenPairs
    modes: Modes
    joint_shares: Mapping[str, FloatArray]
    finer_frequency: FloatArray
    whole_sensitivity: PartSensitivity
    part_sensitivity: PartSensitivity
    test: FiniteElementTest | None
    correlation: FiniteElementCorrelation | None
    base: MachineOption
    options: tuple[MachineOption, ...]
    dampers: FittedDampers
    cut: CuttingDescription

    @property
    def mass(self) -> float:
        """Mass, kg."""
        return sum(self.machine.part_mass.values())

    @property
    def sensitivities(self) -> Mapping[str, ElementSensitivity]:
        """Sensitivities of the frequencies of the whole machine, by part."""
        return self.whole_sensitivity.frequency

    @property
    def part_shares(self) -> dict[str, FloatArray]:
        """Share of every part in the strain energy of every mode: twice the relative change of f with its E."""
        return {name: 2 * s.modulus.sum(axis=1) for name, s in self.sensitivities.items()}

    @cached_property
    def loss_bound(self) -> FloatArray:
        """Bound of the effect of modes left out of the losses, relative, (2, n): on frequency and damping."""
        return bound_left_out(self.machine, self.pairs)[:, :_STUDIED_MODES]

    @property
    def every_option(self) -> tuple[MachineOption, ...]:
        """Machines with other sizes, layers, fillings, and with dampers."""
        return (*self.options, *self.dampers.options)

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """Doubts to be read before the numbers."""
        lines = list(self.correlation.doubts) if self.correlation is not None else []
        lines += question_losses(self.loss_bound)
        if self.finer_frequency.size:
            shift = self.finer_frequency / self.pairs.frequency[:len(self.finer_frequency)] - 1
            mode = int(np.abs(shift).argmax())
            percent = round(100 * float(shift[mode]), 1) + 0.0  # no -0.0
            lines.append(Doubt("mesh", f"a finer mesh moves frequencies by up to {percent:+.1f} % (mode {mode + 1}), and "
                               "differences between machines with them", "of small ones only the sign is to be trusted",
                               figure=abs(float(shift[mode]))))
        return tuple(lines)

    @property
    def notes(self) -> tuple[str, ...]:
        """Assumptions of the numbers."""
        tested = ("the tested machine is virtual: the model with a few stiffnesses changed; its damping is drawn at random",) \
            if self.test is not None else ()
        return (self.pairs.status,
                "all sizes and joint stiffnesses are chosen; joints are springs of the patch's mean motion: what rails and "
                "flanges bend locally between their bolts is not in it",
                f"the damping ratio {_JOINT_DAMPING_RATIO:g} of joints is chosen; losses of materials are solved with it, "
                f"coupled between "
                f"modes (modes left out change damping by at most {100 * float(self.loss_bound[1].max(initial=0.0)):.2g} %): "
                "peaks, depths and dampers hang on it",
                "depths are those of the single-frequency (zero-order) solution; flip lobes and islands are not in it",
                f"the loop of the actuator is judged with the {self.modes.count} modes of the model, a delay and a low-pass: "
                "modes above them, and the actuator's own bending, can make it unstable all the same",
                *self.whole_sensitivity.motion.notes, *tested)

    def mode_rows(self) -> list[list[str]]:
        """Return a row for every mode: frequency, change on the finer mesh, main seats of energy."""
        shares = {**self.part_shares, **self.joint_shares}
        rows = []
        for i, f in enumerate(self.pairs.frequency[:_STUDIED_MODES]):
            seats = sorted(shares, key=lambda name: -shares[name][i])[:3]
            change = f"{100 * (self.finer_frequency[i] / f - 1):+.1f}" if i < self.finer_frequency.size else ""
            rows.append([str(i + 1), f"{f:.2f}", change, ", ".join(f"{name} {100 * shares[name][i]:.0f} %" for name in seats)])
        return rows

    def table(self) -> str:
        """Return modes with their seats of energy, the test, sensitivities, options with their depths, and the dampers."""
        parts = [text_table(f"{self.machine.size} coordinates, {self.mass:.0f} kg",
                            ["mode", "Hz", "finer mesh %", "strain energy in"], self.mode_rows())]
        if self.correlation is not None:
            parts += self.correlation.result_lines()
        parts += [self.whole_sensitivity.table(), self.part_sensitivity.table(),
                  text_table("What helps the cut, against the machine as it is", HEADER,
                             option_rows(self.base, self.every_option)), *damper_lines(self.dampers)]
        return "\n".join([*mark_notes(self.doubts), *parts, *mark_notes(self.notes, "note: ")])

    def to_dict(self) -> dict[str, Any]:
        """Return all of it as plain data."""
        return {"frequency_hz": self.pairs.frequency.tolist(), "mass_kg": self.machine.part_mass,
                "finer_mesh_hz": self.finer_frequency.tolist(),
                "strain_energy": {k: v.tolist() for k, v in {**self.part_shares, **self.joint_shares}.items()},
                "test": None if self.correlation is None else self.correlation.to_dict(),
                "sensitivity": [self.whole_sensitivity.to_dict(), self.part_sensitivity.to_dict()],
                "options": [{"name": o.name, "mass_kg": o.mass, "frequency_hz": o.frequency.tolist(), "peak_m_n": o.peak,
                             "least_depth_m": o.limit.depth, "mean_depth_m": o.limit.mean}
                            for o in (self.base, *self.every_option)],
                "dampers": self.dampers.to_dict(), "doubts": list(self.doubts), "notes": list(self.notes)}


def damper_lines(dampers: FittedDampers) -> list[str]:
    """Return a sentence on each damper."""
    tuned, active = dampers.tuned, dampers.active
    passive_ratio, active_ratio = (depth / active.depths[0] for depth in active.depths[1:])
    return [f"tuned damper of {tuned.mass:.3g} kg: {tuned.frequency:.2f} Hz, ratio {tuned.damping_ratio:.3f} (Den Hartog "
            f"{tuned.start[0]:.2f} Hz, {tuned.start[1]:.3f}); least depth x {tuned.depth_ratio:.2f}; {tuned.status}",
            f"active damper, {active.actuator.mass:.3g} kg moving: gain {active.gain:.3g} N s/m of at most "
            f"{active.largest_gain:.3g}; {active.margins}; least depth x {active_ratio:.2f} (x {passive_ratio:.2f} switched "
            f"off); "
            f"{active.force:.2g} N and {1e6 * active.stroke:.2g} µm of stroke a newton at the tool; {active.status}"]


def study_finite_elements(
    machine: FiniteElementMachine, variants: Mapping[str, FiniteElementMachine] | None = None, *,
    tested: FiniteElementMachine | None = None, finer_machine: FiniteElementMachine | None = None, part: str = "column",
    damper_place: str = "tool:+x", damper_mass: float = 10.0, cut: CuttingDescription = EXAMPLE_FACE_MILL,
    rng: np.random.Generator | None = None, step: Callable[[str], None] = _NO_PROGRESS,
) -> FiniteElementStudy:
    """Return the study of a machine and of variants of it.

    Parameters
    ----------
    machine : FiniteElementMachine
        With points named tool and work.
    variants : mapping of name to FiniteElementMachine, optional
        Other sizes, layers, fillings.
    tested : FiniteElementMachine, optional
        The machine that a virtual hammer test strikes, of the same mesh with other stiffness; no test without it.
    finer_machine : FiniteElementMachine, optional
        The machine on a finer mesh, to say what the mesh does.
    part : str
        The part that is also studied alone.
    damper_place : label
    damper_mass : float
        Moving mass of the dampers, kg.
    cut : CuttingDescription
        By whose depth options are judged.
    rng : numpy.random.Generator, optional
        Of the test.
    step : function, optional
        Called with the name of each step.

    Examples
    --------
    Runs in ``examples/damp_a_mill_of_finite_elements.py``.
    """
    step("modes")
    pairs = machine.solve(_STUDIED_MODES + _EXTRA_MODES)
    modes = solve_losses(machine, pairs, _JOINT_DAMPING_RATIO)
    test = correlation = measured = other = None
    if tested is not None:
        step("hammer test")
        other = tested.solve(_STUDIED_MODES + _EXTRA_MODES)
        test, correlation = _test_machine(machine, pairs, tested, other, np.random.default_rng(1) if rng is None else rng)
        now = correlation.correlation
        # Columns of the measured shapes, and the mode of the model that each is paired with.
        measured = now.measured.dofs, now.measured.shape[:, now.pairs.pairs[:, 0]], tuple(now.pairs.pairs[:, 1].tolist())
    step("sensitivity of every element")
    highest_dof = _highest_node(machine, part)
    whole_sensitivity = study_sensitivity("the whole machine", machine, pairs, dof=highest_dof, measured=measured)
    part_sensitivity = _study_part(machine, tested, part)
    if finer_machine is not None:
        step("finer mesh")
    fine = np.zeros(0) if finer_machine is None else finer_machine.solve(_STUDIED_MODES).frequency[:_STUDIED_MODES]
    step("the cut")
    base = judge_machine("as it is", machine, modes, cut=cut, lines=response_lines(pairs.frequency, cut))
    dampers = fit_dampers(base, modes, damper_place, mass=damper_mass, cut=cut)
    options: list[MachineOption] = []
    for name, variant in (variants or {}).items():
        step(name)
        options += judge_variants({name: variant}, base, cut, number=_STUDIED_MODES + _EXTRA_MODES, joints=_JOINT_DAMPING_RATIO)
    return FiniteElementStudy(machine, pairs, modes, machine.joint_shares(pairs), fine, whole_sensitivity, part_sensitivity,
                              test, correlation, base,
                              tuple(options), dampers, cut)


def _test_machine(machine: FiniteElementMachine, pairs: EigenPairs, tested: FiniteElementMachine, other: EigenPairs,
                  rng: np.random.Generator) -> tuple[FiniteElementTest, FiniteElementCorrelation]:
    # The test is planned on the model, as it would be, and struck on the tested machine.
    planned = plan_nodes(machine, pairs, _TEST_POINTS, struck=_STRUCK_DOFS)
    c, s = np.cos(_TEST_TURN), np.sin(_TEST_TURN)
    frame = tf.transform(np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]), np.array(_TEST_ORIGIN))
    # A real test has another damping in every mode than the model assumes.
    ratio = _JOINT_DAMPING_RATIO * rng.uniform(0.5, 1.5, other.count)
    test = run_hammer_test(tested, other, planned, rng=rng, damping_ratio=ratio, noise=_CHANNEL_NOISE, frame=frame,
                           misplaced=_TEST_PLACE_DEVIATION)
    return test, correlate_finite_elements(machine, pairs, test)


def _study_part(machine: FiniteElementMachine, tested: FiniteElementMachine | None, part: str) -> PartSensitivity:
    """Return the sensitivities of a part alone; its MAC with the same part of the tested machine at the part's corners."""
    single = machine.part_alone(part)
    pairs = single.solve(_STUDIED_MODES)
    measured = None
    if tested is not None:
        corners = _corners(single.nodes)
        dofs = tuple(Dof(node, way) for node in corners for way in ("+x", "+y", "+z"))
        other = tested.part_alone(part)
        # Shapes alone are compared, whatever their damping.
        true = other.modes_at(other.solve(_STUDIED_MODES), dofs, 0.0)
        together = pair_modes(true, single.modes_at(pairs, dofs, 0.0)).pairs
        measured = dofs, true.shape[:, together[:, 0]], tuple(together[:, 1].tolist())
    return study_sensitivity(f"the {part} alone", single, pairs, dof=_highest_node(single, part), measured=measured)


def _corners(nodes: FloatArray) -> Sequence[int]:
    """Return the numbers (from 1) of the nodes nearest to the corners and the middles of the sides of a box about nodes."""
    lower, upper = nodes.min(axis=0), nodes.max(axis=0)
    places = [lower + np.array([i, j, k]) / 2 * (upper - lower) for i in range(3) for j in range(3) for k in range(3)
              if (i, j, k) != (1, 1, 1)]
    return list(dict.fromkeys(int(np.argmin(np.linalg.norm(nodes - place, axis=1))) + 1 for place in places))


def _highest_node(machine: FiniteElementMachine, part: str) -> Dof:
    """Return the first of the highest nodes of a part, along x."""
    model = machine.parts[part]
    return Dof(int(machine.starts[part] // 3 + np.argmax(model.nodes[:, 2])) + 1, "+x")


def study_example_mill(*, step: Callable[[str], None] = _NO_PROGRESS) -> FiniteElementStudy:
    """Return the study of the example mill, with its variants, a virtual test of a mill that differs, and a finer mesh."""
    mill = example_mill()
    return study_finite_elements(mill, example_variants(), tested=example_tested_mill(mill),
                                 finer_machine=example_mill(mesh_size=FINE_EXAMPLE_MESH_SIZE), step=step)
