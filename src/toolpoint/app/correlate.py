"""`toolpoint correlate`: a test beside a machine file: points, modes, bands; where and by how much they differ."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from toolpoint._check import FloatArray, ToolpointError
from toolpoint.app import console
from toolpoint.app.correlation_page import CorrelationRun, Point, Test, page
from toolpoint.app.poses import machine_at
from toolpoint.io import frf_files, geometry_files, mode_files
from toolpoint.io.yaml import component_file
from toolpoint.machine import Machine
from toolpoint.machine.named_points import point_positions
from toolpoint.modal_identification import identify, real_modes
from toolpoint.studies.model_correlation import ModelCorrelation, correlate, with_measured_points
from toolpoint.studies.point_pairing import PointPairing, paired_points
from toolpoint.vibration import Modes


def correlate_files(
    machine: str | Path, files: Sequence[str | Path], geometry: str | Path | None = None,
    components: str | Path | None = None, known: Mapping[str, str] | None = None, furthest: float = 0.05,
    before: str | Path | None = None, pose: Mapping[str, float] | None = None, band: tuple[float, float] | None = None,
    lowest_mac: float = 0.5, output: str | Path = "toolpoint-report", quiet: bool = False,
) -> CorrelationRun:
    """Correlate measured modes or responses with a machine file, print the table, and write the page.

    With `components` the measured points ride on the machine's bodies of these names; otherwise they are paired with the
    machine's own points, by `known` pairs or by registration from where they stand, at most `furthest` (m) apart; without a
    geometry equal names are the same points.
    """
    with console.steps(4, quiet) as step, console.collected_warnings() as warnings:
        step("reading")
        test = _test(files, geometry, components, band)
        step("correlation")
        now, drawn = _correlated(machine_at(machine, pose), test, known, furthest, pose, lowest_mac)
        old = None if before is None else _correlated(machine_at(before, pose), test, known, furthest, pose, lowest_mac)[0]
        step("page")
        path = page(CorrelationRun(now, old), drawn, test, warnings, pose).save(output)
    if not quiet:
        console.OUT.print(now.table(), markup=False, soft_wrap=True)
        for text in warnings:
            console.ERR.print("warning: " + text, markup=False, style="yellow")
        console.OUT.print(f"Page written: {path}", markup=False)
    return CorrelationRun(now, old)


def _test(files: Sequence[str | Path], geometry: str | Path | None, components: str | Path | None,
          band: tuple[float, float] | None) -> Test:
    modes: Modes | None = None
    responses = []
    for file in files:
        if mode_files.holds_modes(file):
            modes = mode_files.read(file)
        else:
            responses.append(file)
    frf = frf_files.read(responses) if responses else None
    if modes is None:
        if frf is None:
            raise ToolpointError("correlate: no file with modes or responses given")
        modes = identify(frf, band=band).modes
    if frf is not None and band is not None:
        frf = frf.between(*band)
    shape = None if geometry is None else geometry_files.read(geometry)
    if components is not None and shape is None:
        raise ToolpointError("--components: needs --geometry for the positions of the points")
    owner = None if components is None else component_file.read(components)[0].points()
    return Test(real_modes(modes), frf, shape, owner)


def _correlated(machine: Machine, test: Test, known: Mapping[str, str] | None, furthest: float,
                pose: Mapping[str, float] | None, lowest_mac: float) -> tuple[ModelCorrelation, Machine]:
    pairing: PointPairing | None = None
    if test.owner is not None and test.geometry is not None:
        machine = with_measured_points(machine, test.geometry.points, test.owner)
    elif test.geometry is not None:
        measured = {d.point for d in test.modes.dofs}
        places = {name: at for name, at in test.geometry.points.items() if name in measured}
        pairing = paired_points(places, point_positions(machine, pose), furthest, _named(known, places))
    return correlate(machine, test.modes, pairing, test.frf, pose, lowest_mac), machine


def _named(known: Mapping[str, str] | None, places: Mapping[Point, FloatArray]) -> dict[Point, Point] | None:
    if not known:
        return None
    number = {str(name): name for name in places}
    return {number.get(key, key): value for key, value in known.items()}


def as_dict(found: ModelCorrelation) -> dict[str, Any]:
    """Return the numbers of a correlation as plain data."""
    one = found.coefficients
    return {
        "points_paired": {str(a): str(b) for a, b in found.points.pairs.items()}, "transform": found.points.transform.tolist(),
        "modes": [{"measured_hz": float(found.measured.frequency[i]), "model_hz": float(found.predicted.frequency[j]),
                   "mac": float(found.mac[i, j])} for i, j in found.pairs.pairs],
        "mean": None if one is None else one.mean, "mass": None if one is None else one.mass,
        "total": None if one is None else one.total, "comac": {str(p): v for p, v in found.comac.items()},
        "ecomac": {str(p): v for p, v in found.ecomac.items()},
        "frac": None if found.frac is None else found.frac.tolist(), "bands_hz": found.bands.tolist()}
