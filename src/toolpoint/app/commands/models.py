"""Commands about measurements, and a model beside its test: identify, joints, update, correlate, compare, sensitivity."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import click
import numpy as np

from toolpoint import io, pages, studies
from toolpoint._check import ToolpointError
from toolpoint.app import console
from toolpoint.app.declare import DeclaredCommand, Help, Reading, command
from toolpoint.app.frame import Frame
from toolpoint.app.options import GEOMETRY, Band, Count, Files, Geometry, MachineFile, Naming, Pose, Poses, Quantity
from toolpoint.app.values import NEW_FILE, NewFile, SourceFile, TwoPoints
from toolpoint.io.quantities.written import read_pairs, read_pole

if TYPE_CHECKING:
    from toolpoint.modal_identification import PoleChoice

TABLE_LEGEND = ("share: part of the responses at its frequency that a mode carries, with those that overlap and look like it; "
                "* stands out, ? doubtful")


Pole = Annotated[tuple[float, float], Reading(read_pole, "frequency and damping, Hz and percent, for example 34.2,1.5")]
Pair = Annotated[dict[str, str], Reading(lambda text: read_pairs(text, str, "TEST=MODEL, for example 12=spindle_nose"))]


@dataclass(frozen=True)
class Choice:
    """Poles that a person adds, and modes that go: a choice file, and poles beside it."""

    choice: Annotated[SourceFile | None, Help("YAML file of poles added and modes removed by hand, as the page writes "
                                              "it.")] = None
    add: Annotated[tuple[Pole, ...], Help("A pole to add: frequency and damping.", metavar="HZ,PERCENT")] = ()
    remove: Annotated[tuple[float, ...], Help("A mode to leave out, by its frequency.", metavar="HZ", above=0)] = ()

    def read(self) -> PoleChoice:
        """Return the choice, an empty one where nothing was given."""
        from toolpoint.modal_identification import PoleChoice

        first = PoleChoice() if self.choice is None else io.read_choice(self.choice)
        return first.extended(self.add, self.remove)


def _command_without_choice() -> str:
    """Return the command as it was typed, without a choice: the page adds the one that a person clicks together."""
    kept, words = [], list(cast(DeclaredCommand, click.get_current_context().command).words)
    while words:
        word = words.pop(0)
        if word in ("--choice", "--add", "--remove"):
            words.pop(0)
        elif not word.startswith(("--choice=", "--add=", "--remove=")):
            kept.append(word)
    return "toolpoint identify " + shlex.join(kept)


@command(steps=3, replace=True)
def identify(run: Frame, files: Files, *, geometry: Geometry = None,
             lines: Annotated[SourceFile | None, Help("Lines between points: CSV (points that a line runs through), or "
                                                      "universal.", needs="--geometry, lines need the places of their "
                                                      "points")] = None,
             method: Annotated[str, Help("Identification method.")] = "refined", band: Band = None, quantity: Quantity = None,
             naming: Naming,
             sensor_mass: Annotated[float | None, Help("Mass of the sensor that was moved between set-ups, g: modes that every "
                                                       "set-up shows anew are joined, and it is taken out of them.", above=0,
                                                       scale=1e-3)] = None,
             between: Annotated[TwoPoints | None, Help("Tool and table, two points of the test: which modes move them "
                                                       "against each other.", metavar="TOOL,TABLE")] = None,
             modes: Annotated[NewFile | None, Help("Save the modes here (HDF5).", name="-m --modes")] = None,
             choice: Choice) -> None:
    """Modes of measured FRFs (universal, HDF5, MATLAB, NumPy or text files), with confidence intervals and a page.

    An output that ends in .h5 is where the modes are saved; the page then goes to its default folder.
    """
    if run.output is not None and run.output.suffix == ".h5":
        # An output that ends in .h5 names the modes: the page goes to its default folder.
        modes = NEW_FILE.convert(run.output, None, click.get_current_context())
        run.output = Path("toolpoint-report")
    frf = io.read_frf(files, quantity=quantity, **naming.keywords)
    shape = None if geometry is None else io.read_geometry(geometry)
    shape = shape if shape is None or lines is None else io.read_lines(lines, shape)
    chosen = choice.read()
    run.step("identification")
    result = studies.identify_modes(frf, method, band, choice=chosen, sensor_mass=sensor_mass, between=between)
    run.step("page")
    run.save(pages.identification_page, result, shape, [file.name for file in files], warnings=run.warnings,
             command=_command_without_choice())
    run.write("Modes", modes, io.write_nouns, result.modes)
    if run.as_json:
        run.show(result)
    run.show_text(result.table(), TABLE_LEGEND, result.status)
    run.show_rest([note for note in frf.notes if not any(console.spell_options(note) in text for text in run.warnings)])


@command(steps=4, replace=True)
def joints(run: Frame, files: Files, *, geometry: Annotated[SourceFile | None, Help(
               f"{GEOMETRY[:-1]}; the measured files where left out, if they hold the places.")] = None,
           components: Annotated[SourceFile, Help("YAML: which points belong to which component, the chain, masses where "
                                                  "known.")],
           written: Annotated[NewFile | None, Help("Write the identified machine here.", name="--machine")] = None,
           coordinate_deviation: Annotated[float | None, Help("Standard deviation of the points' coordinates, mm, in place of "
                                                              "that of the component file.", scale=1e-3)] = None,
           band: Band = None, quantity: Quantity = None, naming: Naming) -> None:
    """Joints of a machine from measured FRFs or saved modes: where, how free, how stiff; and a machine file that runs."""
    shape, described = io.read_test_geometry(geometry, files), io.read_components(components)
    studies.place_test(shape.points, described)  # Unit and frame are questioned before the long fit of modes.
    saved, responses = io.read_test_nouns(files, quantity=quantity, **naming.keywords)
    run.step("modes")
    modes, doubts = studies.modes_of_test(saved, responses, band=band)
    run.step("joints")
    result = studies.study_joints(modes, shape, described, coordinate_deviation=coordinate_deviation, channel_doubts=doubts)
    # What is written is read back and run before it is called the machine of the test.
    if result.machine is not None and run.write("Machine file", written, io.write_machine, result.machine):
        result = result.compared(io.read_machine(cast(Path, written)))
    run.step("page")
    run.save(pages.joints_page, result, run.warnings)
    run.warnings[:] = [text for text in run.warnings if not text.startswith("doubtful")]
    run.show(result)
    if written is not None and result.machine is None:
        raise ToolpointError(f"--machine {written}: not written, because {result.no_machine_reason}")


@command(steps=3, replace=True)
def update(run: Frame, machine: MachineFile, *,
           modes: Annotated[tuple[SourceFile, ...], Help("Measured modes, saved by identify (HDF5); several times for several "
                                                         "measurements.")] = (),
           frf: Annotated[tuple[SourceFile, ...], Help("Measured FRFs (universal, HDF5, MATLAB, text); with several poses one "
                                                       "file for each.")] = (),
           paths: Annotated[tuple[str, ...], Help("Parameter to update; where none is named all joint stiffnesses, by "
                                                  "responses the joints' damping too.", name="--parameter",
                                                  metavar="joints.NAME.stiffness.rx")] = (),
           poses: Poses = (),
           samples: Annotated[int, Help("Sample the posterior by so many steps of every walker, for example 2000 (extra "
                                        "'bayes').", metavar="STEPS", default_text="none", minimum=0)] = 0,
           seed: Annotated[int, Help("Seed of the samples.")] = 1,
           written: Annotated[NewFile | None, Help("Write the updated machine here.", name="--machine")] = None,
           quantity: Quantity = None, naming: Naming) -> None:
    """The machine that agrees with measured modes or responses: what the data can tell is moved, the rest is named.

    Measurements at several poses: --modes a.h5 --pose X=0 --modes b.h5 --pose X=0.2
    """
    built = io.read_machine_at(machine, *poses)
    # One pose: all files of responses are one measurement; several poses: a file for each.
    groups = [[file] for file in frf] if len(poses) > 1 else [list(frf)] if frf else []
    responses = [io.read_frf(group, quantity=quantity, **naming.keywords) for group in groups]
    saved = [io.read_modes(file) for file in modes]
    measured = studies.pair_measurements(saved, responses, poses)
    run.step("updating")
    result = studies.update_machine(built, measured, paths, samples=samples, seed=seed,
                                    what=", ".join(path.name for path in (*modes, *frf)))
    run.write("Machine file", written, io.write_machine, result.machine.description)
    run.present(pages.update_page, result, run.warnings, has_answer=False)


@command(steps=3)
def correlate(run: Frame, machine: MachineFile, files: Files, *, geometry: Geometry = None,
              components: Annotated[SourceFile | None, Help("YAML: which measured points ride on which body of the machine; "
                                                            "otherwise points are paired by place.",
                                                            needs="--geometry, for the positions of the points")] = None,
              pairs: Annotated[tuple[Pair, ...], Help("A measured point and the machine's point that it is; at least three fix "
                                                      "the registration.", name="--pair", metavar="TEST=MODEL")] = (),
              furthest: Annotated[float, Help("Points further apart stay single, mm.", scale=1e-3)] = 50.0,
              original_file: Annotated[SourceFile | None,
                                       Help("The machine before updating, shown beside.", name="--before")] = None,
              lowest_mac: Annotated[float, Help("Modes below are not paired.")] = 0.5, band: Band = None,
              pose: Pose = None, quantity: Quantity = None, naming: Naming) -> None:
    """A test (measured FRFs or saved modes) beside a machine: points, MAC, COMAC, FRAC; where and by how much they differ."""
    built, original = io.read_machine_at(machine,
                                         pose), None if original_file is None else io.read_machine_at(original_file, pose)
    saved, responses = io.read_test_nouns(files, quantity=quantity, **naming.keywords)
    shape = None if geometry is None else io.read_geometry(geometry)
    owner = None if components is None else io.read_components(components).points
    run.step("correlation")
    test = studies.gather_test(saved, responses, geometry=shape, band=band, owner=owner)
    named_pairs = {point: model for pair in pairs for point, model in pair.items()}
    result = studies.compare_with_test(built, test, pose=pose, known_pairs=named_pairs, furthest=furthest, earlier=original,
                                       lowest_mac=lowest_mac)
    run.present(pages.correlation_page, result, run.warnings, has_answer=False)


@command(steps=3)
def compare(run: Frame, older: MachineFile, newer: MachineFile, *, band: Band = None,
            lowest_mac: Annotated[float, Help("Modes below are not paired.")] = 0.5, count: Count = 6, pose: Pose = None,
            seed: Annotated[int, Help("Seed of the drawn noise.")] = 1, quantity: Quantity = None, naming: Naming) -> None:
    """Two states of one machine, two tests or two machine files: what moved in frequencies, shapes and responses.

    Tests are saved modes (HDF5) or measured FRFs, a file each: intervals are those of their noise.
    """
    states = io.read_two_states(older, newer, pose=pose, quantity=quantity, **naming.keywords)
    run.step("comparison")
    result = studies.compare_two_states(*states, band=band, pose=pose, count=count, lowest_mac=lowest_mac,
                                        rng=np.random.default_rng(seed))
    run.present(pages.state_comparison_page, result, run.warnings)


@command(steps=3)
def sensitivity(run: Frame, machine: MachineFile, *,
                paths: Annotated[tuple[str, ...], Help("Parameter to study; all stiffnesses, dampers, masses and densities "
                                                       "where none is named.", name="--parameter",
                                                       metavar="joints.NAME.stiffness.rx")] = (), count: Count = 6,
                change: Annotated[float, Help("Change of a parameter that MAC values are given for, %.", scale=1e-2)] = 10.0,
                elements: Annotated[bool, Help("Every element of castings and solids instead: where a kilogram of wall raises "
                                               "a frequency most.", excludes="--parameter")] = False,
                pose: Pose = None) -> None:
    """Effect of every joint stiffness, damper, mass and density on frequencies, damping and shapes: alone and per part."""
    built = io.read_machine_at(machine, pose)
    if elements:
        run.step("sensitivity of every element")
        run.present(pages.element_page, studies.study_elements(built, pose, count), warnings=run.warnings)
        return
    run.step("sensitivities")
    result = studies.study_sensitivity(built, paths or None, min(count, built.size), pose=pose)
    run.present(pages.sensitivity_page, result, built, change, pose=pose, warnings=run.warnings, has_answer=False)
