"""The parallel head of its source, as tested: frequencies over its two planes, responses over -30 .. 30 degrees, beside it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from toolpoint._check import ComplexArray, FloatArray
from toolpoint._notebook import NotebookText
from toolpoint.cutting.stability.method import StabilityMethod
from toolpoint.machine import Machine
from toolpoint.studies.machines.check.machine_words import describe_motion
from toolpoint.studies.machines.machine_report import MachineReport, study_machine
from toolpoint.studies.machines.pose_map import PoseMap, pose_map
from toolpoint.studies.machines.response_map import ResponseMap, response_map
from toolpoint.studies.machines.tool_point import tool_point

PLANE_HEIGHTS = (-0.55, -0.75)  # m, the source's p_z 550 and 750 mm; the head hangs
PUBLISHED_TILTS = np.radians(np.arange(-30, 31, 2.5))  # the source's -30 to 30 deg
# The source's theta_y and theta_x. Its distributions are symmetric over theta_y, which leaves a limb in the plane across the
# tilt: here that is the tilt towards y, as limb 1 stands on x.
TILT_WAYS = {"theta_y": np.pi / 2, "theta_x": 0.0}
SOURCE_PEAK = (29.0, 1.2, 0.7)  # Hz, µm/N of imaginary and real part, figure 12 of the source
SOURCE_SECOND = (60.0, 70.0)  # Hz, of its model and its test
_PUBLISHED_LINES = np.linspace(5.0, 120.0, 461)  # Hz
_MOVING_SHARE = 0.005  # of the first pair's compliance along u, from which a mode is a peak there


@dataclass(frozen=True, eq=False)
class PublishedHead(NotebookText):
    """Results in the order of the source.

    report : at the described poses; planes : frequencies over tilt and azimuth at `PLANE_HEIGHTS`; responses : by ``theta_y``
    and ``theta_x`` over `PUBLISHED_TILTS` at 750 mm; home : response along u at 550 mm, m/N, over `lines`, Hz; moving :
    frequencies of the modes that move the tool along u there.
    """

    report: MachineReport
    planes: tuple[PoseMap, ...]
    responses: dict[str, ResponseMap]
    lines: FloatArray
    home: ComplexArray
    moving: FloatArray

    def source_lines(self) -> list[str]:
        """Return what the source prints, each beside the number here."""
        f, imaginary, real = SOURCE_PEAK
        peak = self.lines[int(np.abs(self.home).argmax())]
        height, part = 1e6 * np.abs(self.home.imag).max(), 1e6 * np.abs(self.home.real).max()
        seconds = ", ".join(f"{value:.1f}" for value in self.moving[self.moving > 1.2 * peak][:1]) or "none"
        return [
            "Tables 1 and 2 (geometry; frequencies by model and test) are missing in the text at hand: sizes and springs here "
            "are chosen so that the peaks below come out, and these prove nothing by themselves",
            f"Figure 12, highest peak: the source {f:.0f} Hz, imaginary part {imaginary:.1f}, real part {real:.1f} µm/N; here "
            f"{peak:.1f} Hz, {height:.2f} ({100 * (height / imaginary - 1):+.0f} %), {part:.2f} µm/N "
            f"({100 * (part / real - 1):+.0f} %) at p_z 550 mm. The source sets this figure at 550 mm and at 750 mm",
            f"Figure 12, next peak: the source {SOURCE_SECOND[0]:.0f} Hz (model) and {SOURCE_SECOND[1]:.0f} Hz (test); here "
            f"{seconds} Hz",
            *(line for name in TILT_WAYS for line in self._tilt_lines(name))]

    def _tilt_lines(self, name: str) -> list[str]:
        """Return a line each on the responses along u and v over a tilt, figures 13 and 14 of the source."""
        source = {("theta_y", "u"): "greatest at 0, falling clearly to both sides, symmetric",
                  ("theta_y", "v"): "greatest at 0, falling less, symmetric",
                  ("theta_x", "u"): "frequency rises from -30 to 30 deg, height hardly changes",
                  ("theta_x", "v"): "greatest at -5 deg, falling to both sides"}
        result, lines = self.responses[name], []
        for k, way in ((1, "u"), (0, "v")):
            size = 1e6 * result.greatest().reshape(len(PUBLISHED_TILTS), 3)[:, k]
            frequency = result.frequency[np.abs(result.values.reshape(len(PUBLISHED_TILTS), -1, 3)[..., k]).argmax(axis=1)]
            figure = "Figure 13" if name == "theta_y" else "Figure 14"
            lines.append(f"{figure}, {name}, along {way}: the source {source[name, way]}; here greatest at "
                         f"{np.degrees(PUBLISHED_TILTS[size.argmax()]):+.1f} deg, {size.max():.2f} µm/N, and {size[0]:.2f}, "
                         f"{size[len(size) // 2]:.2f}, {size[-1]:.2f} µm/N at -30, 0, 30 deg ({frequency[0]:.1f}, "
                         f"{frequency[len(size) // 2]:.1f}, {frequency[-1]:.1f} Hz)")
        return lines

    def table(self) -> str:
        """Return the report, what stands beside the source, and the extremes of the maps as text."""
        planes = [f"p_z {-1e3 * z:.0f} mm, {line}" for z, plane in zip(PLANE_HEIGHTS, self.planes, strict=True)
                  for line in plane.extremes()]
        return "\n".join([self.report.table(), *describe_motion(self.report.machine), *planes, *self.source_lines()])

    def to_dict(self) -> dict[str, Any]:
        """Return all parts as plain data."""
        return {"report": self.report.to_dict(), "planes": [plane.to_dict() for plane in self.planes],
                "responses": {name: part.to_dict() for name, part in self.responses.items()}, "source": self.source_lines()}


def study_published_head(machine: Machine, *, step: Callable[[str], None] = lambda name: None,
                      method: StabilityMethod | None = None) -> PublishedHead:
    """Return what the source of the parallel head shows, of a head whose task is Z, tilt and azimuth.

    Examples
    --------
    >>> np.degrees(PUBLISHED_TILTS[[0, -1]]).round().tolist(), [round(1e3 * z) for z in PLANE_HEIGHTS]  # where it is asked
    ([-30.0, 30.0], [-550, -750])
    """
    report = study_machine(machine, step=step, method=method)
    step("frequencies over the source's planes")
    tilt, azimuth = np.radians(np.linspace(0, 30, 7)), np.radians(np.linspace(0, 360, 19))
    planes = tuple(pose_map(machine, {"tilt": tilt, "azimuth": azimuth, "Z": [z]}) for z in PLANE_HEIGHTS)
    step("responses over -30 to 30 degrees")
    grids = {name: {"tilt": PUBLISHED_TILTS, "azimuth": [way], "Z": [PLANE_HEIGHTS[1]]} for name, way in TILT_WAYS.items()}
    responses = {name: response_map(machine, grid, _PUBLISHED_LINES) for name, grid in grids.items()}
    home = tool_point(machine, [{"Z": PLANE_HEIGHTS[0], "tilt": 0.0, "azimuth": 0.0}], _PUBLISHED_LINES)
    modes = home.modes
    give = np.abs(np.asarray(modes.shape[0])[1]) ** 2 / (2 * np.pi * modes.frequency[0]) ** 2
    moving = modes.frequency[0][give > _MOVING_SHARE * give[:2].sum()]
    return PublishedHead(report, planes, responses, _PUBLISHED_LINES, home.frf.values[0, :, 1, 1], np.asarray(moving))
