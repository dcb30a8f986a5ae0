"""Steps of measurements: records to responses, responses to modes, a tapped tip to its verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from toolpoint import io, studies
from toolpoint._doubt import Doubt, doubts_among
from toolpoint.modal_identification import Identification
from toolpoint.project.engine.step import StepOutcome
from toolpoint.project.steps.plain_files import write_json
from toolpoint.studies.measured.hammer_study import HammerStudy
from toolpoint.studies.measured.shaker_study import ShakerStudy
from toolpoint.studies.testing.tap_study import Light

MAX_SHOWN_FREQUENCIES = 12  # modes that the words of a step name


def make_responses(folder: Path, test: Path | None = None, records: Sequence[Path] = (), *, channels: Sequence[str] = (),
                   struck: str | None = None, pattern: str | None = None) -> StepOutcome:
    """Write the responses of records by hammer or shaker (responses.h5), and the verdict on every hit (hits.json)."""
    study = _study_records(test, records, channels, struck=struck, pattern=pattern)
    io.write_frf(study.frf, folder / "responses.h5")
    write_json(folder / "hits.json", study.to_dict())
    return StepOutcome(study.status, study.doubts)


def _study_records(test: Path | None, records: Sequence[Path], channels: Sequence[str], *, struck: str | None,
                   pattern: str | None) -> HammerStudy | ShakerStudy:
    if test is not None:
        read, description = io.read_hammer_test(test)
    else:
        read, description = io.read_described_records(records, channels, struck=struck, pattern=pattern)
    return studies.study_described_records(read, description)


def gather_responses(folder: Path, responses: Sequence[Path], *, struck: str | None = None, pattern: str | None = None
                     ) -> StepOutcome:
    """Write measured responses of any format as one file (responses.h5)."""
    frf = io.read_frf(responses, pattern=pattern, struck=struck)
    io.write_frf(frf, folder / "responses.h5")
    words = (f"{len(frf.outputs)} x {len(frf.inputs)} responses ({frf.quantity}), {frf.frequency[0]:.4g} .. "
             f"{frf.frequency[-1]:.4g} Hz")
    return StepOutcome(words, tuple(doubts_among(frf.notes)))


def find_modes(folder: Path, responses: Path, choice: Path | None = None, *, band: Sequence[float] | None = None,
               sensor_mass: float | None = None, whole_band: bool = False) -> StepOutcome:
    """Write the modes of responses (modes.h5, modes.json).

    choice : file of poles added and modes removed by hand; whole_band : all lines, where a tester has cut them already.
    """
    result, chosen = identify_responses(responses, choice, band=band, sensor_mass=sensor_mass, whole_band=whole_band)
    io.write_nouns(result.modes, folder / "modes.h5")
    write_json(folder / "modes.json", {
        "status": result.status, "frequency_hz": result.modes.frequency, "damping_ratio": result.modes.damping_ratio,
        "frequency_interval_hz": result.modes.frequency_interval, "damping_interval": result.modes.damping_interval,
        "doubtful": result.doubtful, "advice": list(result.advice), "band_hz": chosen})
    frequencies = ", ".join(f"{frequency:.4g}" for frequency in result.modes.frequency[:MAX_SHOWN_FREQUENCIES])
    hidden = result.modes.count - MAX_SHOWN_FREQUENCIES
    by_hand = [] if result.choice is None or result.choice.is_empty else [
        Doubt("modes", result.choice.remark, "toolpoint identify without --choice finds them anew")]
    return StepOutcome(f"{result.modes.count} modes: {frequencies} Hz" + (f" and {hidden} more" if hidden > 0 else ""),
                       (*result.doubts, *by_hand))


def identify_responses(responses: Path, choice: Path | None = None, *, band: Sequence[float] | None = None,
                       sensor_mass: float | None = None, whole_band: bool = False
                       ) -> tuple[Identification, tuple[float, float] | None]:
    """Return the modes of a file of responses as a project identifies them, and the band (Hz), None where it is found."""
    frf = io.read_frf([responses])
    chosen = (band[0], band[1]) if band else (float(frf.frequency[0]), float(frf.frequency[-1])) if whole_band else None
    poles = None if choice is None else io.read_choice(choice)
    return studies.identify_modes(frf, band=chosen, choice=poles, sensor_mass=sensor_mass), chosen


def judge_tip(folder: Path, values: Mapping[str, Any], tests: Mapping[str, Any], **files: Any) -> StepOutcome:
    """Write the verdict on a tap test of a tip (tap.json): a light for each step of it; red ones are grave doubts.

    files : test_x, records_x, test_y, records_y; tests : channels, struck and pattern of both directions.
    """
    directions = [_tap_of(way, tests[way], files) for way in ("x", "y") if way in tests]
    result = studies.study_tap(directions[0], directions[1] if len(directions) > 1 else None, dict(values),
                               rng=np.random.default_rng(0))
    write_json(folder / "tap.json", result.to_dict())
    doubts = [_doubt_of(light) for light in result.lights if light.colour != "green"]
    return StepOutcome(result.status, tuple(dict.fromkeys(doubts)))


def _tap_of(way: str, settings: Mapping[str, Any], files: Mapping[str, Any]) -> Any:
    """Return the hammer study of one direction's records, or its responses."""
    if (responses := files.get(f"responses_{way}")) is not None:
        return io.read_frf(responses, struck=settings["struck"], pattern=settings["pattern"])
    study = _study_records(files.get(f"test_{way}"), files.get(f"records_{way}", ()), settings["channels"],
                           struck=settings["struck"], pattern=settings["pattern"])
    return study if isinstance(study, HammerStudy) else study.frf


def _doubt_of(light: Light) -> Doubt:
    """Return what a light that is not green says as a doubt, grave where it is red."""
    return Doubt(light.step, light.words, light.remedy, grave=light.colour == "red")
