"""Commands about hammer tests, from the plan to what to measure next: plan, frf, tap, next-test."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np

from toolpoint import io, pages, studies
from toolpoint._check import ToolpointError
from toolpoint.app import console
from toolpoint.app.cut_options import CutValues
from toolpoint.app.declare import Argument, Help, Reading, command, list_given
from toolpoint.app.frame import Frame
from toolpoint.app.live_options import LiveBlows
from toolpoint.app.options import Files, MachineFile, Pose, Poses, Quantity, Variables
from toolpoint.app.values import AnyPath, AxisRange, Lines, NewFile, SourceFile, Span, SpindleSpeeds
from toolpoint.io.quantities.written import read_shaker
from toolpoint.io.suffixes import YAML
from toolpoint.studies.machines.pose_words import pose_words

if TYPE_CHECKING:
    from toolpoint.machine import Machine
    from toolpoint.signals.record_set import RecordSet
    from toolpoint.signals.test_description import HammerTestDescription

Shaker = Annotated[tuple[str, dict[str, float]], Reading(
    read_shaker, "NAME=VALUE with commas between, for example stands=table,body=20kg,armature=0.4kg,suspension=5N/mm")]
# Options that the test file states: beside one they would say something else than it does, and are refused.
TEST_FILE_OPTIONS = ("channel", "struck", "name", "rate", "variables", "excitation", "resolution", "zoom", "settle")


@command()
def plan(run: Frame, machine: MachineFile, *, pose: Pose = None,
         number: Annotated[int | None, Help("Points to measure, three directions each; 12, or as many as the modes need, where "
                                            "left out.", name="--points", minimum=1)] = None,
         file_points: Annotated[bool, Help("Choose among the points that the machine file names, not among 131 spread over its "
                                           "bodies.")] = False,
         highest: Annotated[float | None, Help("Highest mode that matters, Hz; the 18th of the machine where left "
                                               "out.")] = None,
         struck: Annotated[int, Help("Most points and directions to strike.", minimum=1)] = 3,
         noise: Annotated[float, Help("Noise of the virtual test, percent of every channel.", scale=1e-2)] = 1.0,
         hits: Annotated[int, Help("Blows at every set-up.", minimum=1)] = 3,
         seed: Annotated[int, Help("Seed of the points that could be measured, and of the virtual tests.")] = 1,
         test: Annotated[NewFile | None, Help("Write the test file for `toolpoint frf` here (YAML).")] = None,
         geometry: Annotated[NewFile | None, Help("Write the points here (CSV).")] = None) -> None:
    """Plan a hammer test of a machine: where to measure and strike, how long, how fine, and which errors to expect.

    Points are chosen among 131 spread over the bodies, or among those that the file names, so that the modes of the file are
    told apart; a virtual test says what they give, beside random points.
    """
    built = io.read_machine_at(machine, pose)
    result = studies.plan_test(built, number, pose=pose, highest=highest, struck=struck, noise=noise, hits=hits,
                               candidates=studies.list_points(built) if file_points else None,
                               rng=np.random.default_rng(seed), progress=run.progress_of_parts())
    run.write("Points", geometry, io.write_points, result.candidates.coordinates, result.points)
    run.write("Test file", test, io.write_planned_test, built.name, result.struck, block=result.block,
              geometry=None if geometry is None else geometry.name)
    run.present(pages.plan_page, result, run.warnings, notes=result.notes, has_answer=False)


@dataclass(frozen=True)
class RecordOptions:
    """Options of `frf` that are for records: labels, blocks, decisions, and where the test is written."""

    channel: Annotated[tuple[str, ...], Help("Records: what a channel (by name or number) measures, where, its sensitivity; "
                                             "several times.", metavar="'1=force 5:-z 2.25mV/N'")] = ()
    struck: Annotated[str | None, Help("Records: where and in which direction the hammer struck.",
                                       metavar="POINT:DIRECTION")] = None
    name: Annotated[str | None, Help("Records: where names of files say what was struck: P{input}_*.",
                                     metavar="PATTERN")] = None
    rate: Annotated[float | None, Help("Records: samples per second, Hz, where the files do not say it.")] = None
    variables: Annotated[Variables | None, Help("Records: variables of MATLAB and NumPy files (time, rate, samples).",
                                                metavar="time=t,samples=y")] = None
    block: Annotated[float | None, Help("Records: length of a block, s; the longest that fits where left out.")] = None
    window_end: Annotated[float | None, Help("Records: end value of the exponential window; 1 is none; what the slowest mode "
                                             "needs where left out.")] = None
    estimator: Annotated[Literal["H1", "H2", "Hv"] | None, Help("Records: H1 where left out.")] = None
    excitation: Annotated[Literal["random", "burst", "swept", "pseudo-random"] | None, Help(
        "Records of a shaker: how it moves. Bursts and sweeps begin and end in a block; a hammer where left out.")] = None
    resolution: Annotated[float | None, Help("Shaker: spacing of the lines, Hz; a block lasts one over it.", above=0)] = None
    zoom: Annotated[Span | None, Help("Shaker: only these lines, Hz.", metavar="LOW:HIGH")] = None
    settle: Annotated[int, Help("Shaker: blocks left out at the start, until a repeated force has settled.", minimum=0)] = 0
    accept: Annotated[tuple[str, ...], Help("Records: use this hit whatever is judged; several times.", metavar="HIT")] = ()
    refuse: Annotated[tuple[str, ...], Help("Records: do not use this hit; several times.", metavar="HIT")] = ()
    test: Annotated[AnyPath | None, Help("Records: write or update this test file (YAML): channels, records, every "
                                         "decision.")] = None

    @property
    def decisions(self) -> dict[str, bool]:
        """Decisions of a person about hits."""
        if both := set(self.accept) & set(self.refuse):
            raise ToolpointError(f"--accept and --refuse {both.pop()}: must be one of them")
        return {**dict.fromkeys(self.accept, True), **dict.fromkeys(self.refuse, False)}

    def read(self, files: Sequence[Path]) -> tuple[RecordSet, HammerTestDescription]:
        """Return the records of a test file, or of files of records, and the description of their test."""
        if files[0].suffix.lower() not in YAML:
            return io.read_described_records(
                files, self.channel, struck=self.struck, pattern=self.name, rate=self.rate, variables=self.variables,
                block=self.block, window_end=self.window_end, estimator=self.estimator or "H1",
                excitation=self.excitation or "hammer", resolution=self.resolution, zoom=self.zoom or (), settle=self.settle,
                folder=None if self.test is None else self.test.parent)
        if labelling := list_given(*TEST_FILE_OPTIONS):
            raise ToolpointError(f"{labelling[0]}: is in the test file {files[0]}; change it there")
        return io.read_hammer_test(files)


@dataclass(frozen=True)
class MachineResponse:
    """Options of `frf` for a machine: poses, response and force labels, lines."""

    pose: Poses = ()
    outputs: Annotated[tuple[str, ...], Help("Response seen here, e.g. tool-table:+x or 7:+z; several times. Tool against "
                                             "table where left out.", name="--at", metavar="POINT:DIRECTION")] = ()
    inputs: Annotated[tuple[str, ...], Help("Force here; where it is seen, where left out.", name="--force",
                                            metavar="POINT:DIRECTION")] = ()
    drives: Annotated[SourceFile | None, Help("Drive file: responses with its drives on, off, shorted and braked.")] = None
    shaker: Annotated[Shaker | None, Help("Responses as a shaker measures them that pushes at --force or --at.",
                                          metavar="stands=table,body=20kg,armature=0.4kg,suspension=5N/mm")] = None
    lines: Annotated[Lines | None, Help("Lines in Hz, for example 5:400:1600; over all modes where left out.",
                                        metavar="LOW:HIGH:NUMBER")] = None
    state_space: Annotated[NewFile | None, Help("Write the machine's state space here: A, B, C, D with names, .mat, .npz or "
                                                ".h5; one pose.")] = None


@command(steps=3, replace=True)
def frf(run: Frame, files: Files, response: MachineResponse, *,
        save: Annotated[NewFile | None, Help("Save the responses here: .h5, .uff, .mat, .npz or .csv; of a machine one "
                                             "pose.")] = None, records: RecordOptions) -> None:
    """Frequency responses: of a machine file at poses, or of the records of a test by hammer or shaker.

    FILES are one machine file (YAML): responses of the tool against the table, with 95 % intervals where its numbers were
    identified. Or records of hammer hits (universal 58, CSV, LVM, WAV, TDMS, MATLAB, NumPy, HDF5), one hit a file or many, or a
    test file (YAML with 'test' and 'records'): every hit is judged, and good ones give the responses. Or records of one shaker
    or several at once (--excitation, --resolution).
    """
    if save is not None:
        io.check_writable(save)
    of_machine = len(files) == 1 and files[0].suffix.lower() in YAML and io.kind_of(files[0]) != "test"
    if other := list_given(*(vars(records if of_machine else response))):
        raise ToolpointError(f"{other[0]}: is for " + (f"records of a hammer test; {files[0]} is a machine file" if of_machine
                                                       else f"a machine file; {files[0]} is a record of a hammer test"))
    if of_machine:
        _respond(run, files[0], response, save)
    else:
        _measure(run, files, records, save)


def _respond(run: Frame, machine: Path, response: MachineResponse, save: Path | None) -> None:
    """Save and show the responses of a machine at poses."""
    if save is not None and len(response.pose) > 1:
        raise ToolpointError(f"--save {save}: {len(response.pose)} poses; a file of responses holds one; call once for each")
    built = io.read_machine_at(machine, *response.pose)
    notes = () if response.state_space is None else _write_state_space(run, built, response)
    if response.drives is not None:
        _respond_with_drives(run, built, response, save)
        return
    if response.shaker is not None:
        _respond_to_shaker(run, built, response, save)
        return
    result = studies.study_responses_of_machine(built, response.pose or None, response.outputs or None,
                                                inputs=response.inputs or None,
                                                frequency=response.lines,
                                                keep_draws=save is not None, progress=run.progress("intervals"))
    run.write("Responses", save, io.write_frf, result.frfs[0])
    if save is not None and len(result.frfs) > 1:
        run.warnings.append(f"{save.name} holds the first of {len(result.frfs)} described poses alone, "
                            f"{pose_words(built, result.poses[0])}; name another with --pose")
    run.present(pages.responses_page, result, run.warnings, notes=[*notes, *result.notes], has_answer=False)


def _write_state_space(run: Frame, machine: Machine, response: MachineResponse) -> tuple[str, ...]:
    """Write the equations of a machine at one pose as a state space, without its drives; return what it rests on."""
    if len(response.pose) > 1 or response.drives is not None or response.shaker is not None:
        raise ToolpointError("--state-space: of the machine alone at one pose; leave --drives, --shaker and further poses out")
    system, notes = studies.state_space_of_machine(machine, next(iter(response.pose), None), response.outputs or None,
                                                   inputs=response.inputs or None)
    run.write("State space", response.state_space, io.write_noun, system)
    return notes


def _respond_with_drives(run: Frame, machine: Machine, response: MachineResponse, save: Path | None) -> None:
    """Save the responses with the drives on, and show those of every state."""
    if response.inputs or len(response.pose) > 1:
        raise ToolpointError("--drives: forces act where motions are seen, at one pose; leave --force and further poses out")
    assert response.drives is not None
    drives = io.read_drives(response.drives)
    driven = studies.study_driven_responses(machine, drives, next(iter(response.pose), None), dofs=response.outputs or None,
                                            frequency=response.lines)
    run.write("Responses with the drives on", save, io.write_frf, driven.frfs["on"])
    run.present(pages.driven_responses_page, driven, run.warnings, notes=[*driven.doubts, *driven.notes])


def _respond_to_shaker(run: Frame, machine: Machine, response: MachineResponse, save: Path | None) -> None:
    """Save the responses with the shaker on the machine, and show them beside the true ones."""
    driven = [*response.inputs, *response.outputs][:1]
    if not driven or len(response.inputs) > 1 or len(response.pose) > 1:
        raise ToolpointError("--shaker: one point that it pushes (--force, or --at alone), at one pose")
    assert response.shaker is not None
    stand, numbers = response.shaker
    shaker, coil = studies.describe_shaker(numbers)
    result = studies.stand_shaker(machine, shaker, driven[0], stand=stand, outputs=response.outputs or None,
                                  pose=next(iter(response.pose), None), frequency=response.lines, coil=coil)
    run.write("Responses with the shaker on the machine", save, io.write_frf, result.standing)
    run.present(pages.shaker_stand_page, result, run.warnings, notes=[*result.doubts, *result.notes])


def _measure(run: Frame, files: Sequence[Path], options: RecordOptions, save: Path | None) -> None:
    """Save and show the responses of hammer records; write their test file."""
    records, description = options.read(files)
    if (settings := description.shaker) is not None:
        run.step("blocks")
        shaken = studies.study_shaker_records(records, settings, masses=description.sensor_masses)
        run.write("Responses", save, io.write_frf, shaken.frf)
        run.write("Test file", options.test, io.write_test, description, replace=options.test in files)
        run.present(pages.shaker_page, shaken, run.warnings, notes=[*shaken.doubts, *shaken.notes, *shaken.band.notes])
        return
    run.step("hits")
    result = studies.study_hammer_records(
        records, duration=options.block or description.block, final=options.window_end or description.window_end,
        estimator=options.estimator or description.estimator, decisions=options.decisions,
        masses=description.sensor_masses)
    run.write("Responses", save, io.write_frf, result.frf)
    run.write("Test file", options.test, io.write_test, description.with_decisions({**records.decisions, **options.decisions}),
              replace=options.test in files)
    run.step("page")
    run.save(pages.hammer_page, result, run.warnings, description.test)
    run.warnings[:] = [text for text in run.warnings if text not in (*result.doubts, *result.notes)]
    run.show(result, [*result.doubts, *result.notes, *result.band.notes])


@dataclass(frozen=True)
class TapLabels:
    """Quantity and place of what records or responses of the tip measured."""

    channel: Annotated[tuple[str, ...], Help("What a channel of the records measures, where, its sensitivity; several times.",
                                             metavar="'1=force tip:+x 2.25mV/N'")] = ()
    name: Annotated[str | None, Help("Where names of files say points: Point_{input}_*.", metavar="PATTERN")] = None
    struck: Annotated[str | None, Help("Where was struck (or measured), where the names do not say it.",
                                       metavar="POINT:DIRECTION")] = None
    quantity: Quantity = None

    def read(self, files: Sequence[Path], progress: Any) -> Any:
        """Return the hammer study of records, or the responses that files hold."""
        progress("reading", 0, 1)
        if files[0].suffix.lower() in YAML:
            records, description = io.read_hammer_test(files)
            return studies.study_hammer_records(records, duration=description.block, final=description.window_end,
                                                estimator=description.estimator)
        if io.hold_records(files):
            records = io.read_records(files, self.channel, struck=self.struck, pattern=self.name)
            return studies.study_hammer_records(records)
        return io.read_frf(files, quantity=self.quantity, pattern=self.name, struck=self.struck)


@command()
def tap(run: Frame, files: Annotated[tuple[SourceFile, ...], Argument()] = (), *,
        across: Annotated[tuple[SourceFile, ...], Help("Records or responses along y; several times. As x where left out.",
                                                       name="--y")] = (),
        tip: Annotated[str | None, Help("The tip along x where the files hold several driving points.",
                                        metavar="POINT:DIRECTION")] = None,
        labels: TapLabels, cut: CutValues,
        speeds: Annotated[SpindleSpeeds | None, Help("Spindle speeds that the machine has, rev/min.",
                                                     metavar="3000:20000:200")] = None, live: LiveBlows) -> None:
    """Spindle speeds to use, from hammer blows on a tool's tip, with a light for each step.

    FILES are the records of blows along x, the feed (any format of `toolpoint frf`, or its test file), or responses of the tip
    (any format of `toolpoint identify`); --y those along y. Give the cutter (--diameter, --teeth ...) and the material
    (--material, or --kt and --kn). With --live blows are recorded now: each is kept in --folder, judged at once in words and by
    the terminal's bell, and added to the responses on the page.
    """
    progress = run.progress_of_parts()
    if bool(files) == live.live:
        raise ToolpointError("FILES and --live: must be one of them; name files of blows, or record them now with --live")
    if live.live:
        x = _record_blows(run, labels, live)
        if x is None or not cut:
            return
    else:
        x = labels.read(files, progress)
    y = labels.read(across, progress) if across else None
    ends = None if speeds is None else (float(speeds[0]), float(speeds[-1]))
    result = studies.study_tap(x, y, cut, tip=tip, speeds=ends, rng=np.random.default_rng(0), progress=progress)
    run.present(pages.tap_page, result, run.warnings, notes=result.limits.notes)


def _record_blows(run: Frame, labels: TapLabels, live: LiveBlows) -> Any:
    """Record blows, with their page written after each; return their study, None where no blow was good."""
    def show(study: Any, is_growing: bool = True) -> None:
        run.save(pages.hammer_page, study, run.warnings, "Live tap test", is_growing=is_growing)

    source = live.open(labels.channel)
    # What the kind of input falsifies stands before everything that rests on it, limits and pages too.
    run.file_doubts += source.device.doubts
    folder, tap, fault = live.follow(source, show)
    if fault is not None:
        console.warning(f"{fault}; {tap.good} good blows are kept in {folder.folder}")
    if tap.study is not None:
        show(tap.study, False)
        run.show(tap.study, [*tap.study.doubts, *tap.study.notes])
    run.suggest(f"tap {folder.test_file} --diameter ... --teeth ... --material ...", f"frf {folder.test_file}")
    return tap.study


@command(page=False)
def next_test(run: Frame, machine: MachineFile, *, pose: Pose = None,
              axes: Annotated[tuple[AxisRange, ...], Help("Poses that could be tested next; several times.", name="--axis",
                                                          metavar="X=-300mm:300mm:5")] = (),
              frequency_deviation: Annotated[float, Help("Relative, of measured frequencies.")] = 1e-4,
              shape_deviation: Annotated[float, Help("Of shapes, over the greatest motion of the mode.")] = 0.02) -> None:
    """Rank the points, directions and poses whose measurement would narrow the tool's compliance at a pose most."""
    built = io.read_machine_at(machine, pose)
    grid = io.lay_grid(built, axes)
    poses = [dict(zip(grid, map(float, row), strict=True)) for row in itertools.product(*grid.values())] if axes else []
    run.show(studies.rank_tests(built, pose, poses, frequency_deviation=frequency_deviation, shape_deviation=shape_deviation,
                                progress=run.progress("slopes")))
