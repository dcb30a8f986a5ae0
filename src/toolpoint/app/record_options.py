"""What `toolpoint frf` does with records of a hammer test: every hit judged, responses, page, test file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from toolpoint._check import ToolpointError
from toolpoint.app.frame import frame
from toolpoint.app.naming import pairs_of


@dataclass(frozen=True)
class RecordOptions:
    """Options of `frf` that are for records: labels, blocks, decisions, and where the test is written."""

    channel: tuple[str, ...] = ()
    struck: str | None = None
    name: str | None = None
    rate: float | None = None
    variables: str | None = None
    block: float | None = None
    window_end: float | None = None
    estimator: str | None = None
    accept: tuple[str, ...] = ()
    refuse: tuple[str, ...] = ()
    test: Path | None = None

    @property
    def given(self) -> list[str]:
        """Names of the options that were given."""
        return ["--" + name.replace("_", "-") for name, value in vars(self).items() if value not in (None, ())]


def record_options(command: Any) -> Any:
    """Add the options of records to a command."""
    for option in reversed((
            click.option("--channel", multiple=True, metavar="'1=force 5:-z 2.25mV/N'",
                         help="Records: what a channel (by name or number) measures, where, its sensitivity; several times."),
            click.option("--struck", metavar="POINT:DIRECTION", help="Records: where and in which direction the hammer "
                                                                     "struck."),
            click.option("--name", metavar="PATTERN", help="Records: where names of files say what was struck: P{input}_*."),
            click.option("--rate", type=float, help="Records: samples per second, Hz, where the files do not say it."),
            click.option("--variables", metavar="time=t,samples=y",
                         help="Records: variables of MATLAB and NumPy files (time, rate, samples)."),
            click.option("--block", type=float, help="Records: length of a block, s; the longest that fits where left out."),
            click.option("--window-end", type=float, help="Records: end value of the exponential window; 1 is none; what the "
                                                          "slowest mode needs where left out."),
            click.option("--estimator", type=click.Choice(["H1", "H2", "Hv"]), help="Records: H1 where left out."),
            click.option("--accept", multiple=True, metavar="HIT", help="Records: use this hit whatever is judged; several "
                                                                        "times."),
            click.option("--refuse", multiple=True, metavar="HIT", help="Records: do not use this hit; several times."),
            click.option("--test", type=click.Path(path_type=Path),
                         help="Records: write or update this test file (YAML): channels, records, every decision."))):
        command = option(command)
    return command


def measure(files: Sequence[Path], options: RecordOptions, *, save: Path | None, output: Path, as_json: bool) -> None:
    """Form the responses of records or of a test file; print the hits, write page, responses and test file."""
    from toolpoint.io.measured import frf_writing
    from toolpoint.io.yaml.testing import test_file
    from toolpoint.pages.measured.hammer_records import hammer_page
    from toolpoint.studies.measured.hammer_study import study_hammer_records

    if save is not None:
        frf_writing.check_writable(save)
    with frame(output, as_json, steps=3) as run:
        run.step("reading")
        records, description = _records(files, options)
        run.step("hits")
        result = study_hammer_records(
            records, duration=options.block or description.block, final=options.window_end or description.window_end,
            estimator=options.estimator or description.estimator, decisions=_decisions(options))
        run.step("page")
        run.save(hammer_page(result, run.warnings, description.test))
        if save is not None:
            frf_writing.write(result.frf, save)
        if options.test is not None:
            test_file.write(_decided(description, records.decisions, options), options.test, replace=options.test in files)
    run.warnings[:] = [text for text in run.warnings if text not in (*result.doubts, *result.notes)]
    run.show(result, [*(f"doubt: {line}" for line in result.doubts), *result.notes, *result.band.notes],
             {"Responses": save, "Test file": options.test})


def _records(files: Sequence[Path], options: RecordOptions) -> tuple[Any, Any]:
    """Return the records, and the description of their test."""
    from toolpoint.io.measured import record_files
    from toolpoint.io.measured.channels import parse_channel
    from toolpoint.io.suffixes import YAML
    from toolpoint.io.yaml.testing import test_file
    from toolpoint.signals.test_description import HammerTestDescription, RecordsDescription

    if files[0].suffix.lower() in YAML:
        if len(files) > 1:
            raise ToolpointError(f"{files[1]}: beside the test file {files[0]}; a test file names its records itself")
        labelling = [name for name in options.given if name in ("--channel", "--struck", "--name", "--rate", "--variables")]
        if labelling:
            raise ToolpointError(f"{labelling[0]}: is in the test file {files[0]}; change it there")
        description = test_file.read(files[0])
        return record_files.read_test(description, files[0].parent), description
    channels = [parse_channel(text) for text in options.channel]
    records = record_files.read_all(files, channels, struck=options.struck, pattern=options.name, rate=options.rate,
                                    variables=pairs_of("--variables", options.variables))
    base = None if options.test is None else options.test.parent.resolve()
    names = tuple(_relative(file, base) for file in files)
    return records, HammerTestDescription(
        "Hammer test", (RecordsDescription(names, options.struck, options.name),), tuple(channels), _estimator(options),
        options.block, options.window_end, options.rate)


def _estimator(options: RecordOptions) -> Any:
    return options.estimator or "H1"


def _relative(file: Path, base: Path | None) -> str:
    full = file.resolve()
    return str(full.relative_to(base)) if base is not None and full.is_relative_to(base) else str(full)


def _decisions(options: RecordOptions) -> dict[str, bool]:
    both = set(options.accept) & set(options.refuse)
    if both:
        raise ToolpointError(f"--accept and --refuse {both.pop()}: must be one of them")
    return {**dict.fromkeys(options.accept, True), **dict.fromkeys(options.refuse, False)}


def _decided(description: Any, before: Any, options: RecordOptions) -> Any:
    """Return the description of the test with the decisions of a person about hits."""
    from dataclasses import replace

    words = {True: "accepted", False: "refused"}
    hits = {name: words[accept] for name, accept in {**before, **_decisions(options)}.items()}
    return replace(description, hits=hits)
