"""Rotation, scale, mirror and tilted plane of Fanuc controls: G68 X Y R, G68.2 and G69, G51 and G50, G51.1 and G50.1."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from toolpoint.io.program.control.frame import AXES, PLANES, diagonal, rotation
from toolpoint.io.program.control.modes import CENTER, ControlModes, Places
from toolpoint.io.program.control.tilted_planes import cancel, tilt_by_euler

MIN_THOUSANDTHS = 100  # from it on a whole factor P of G51 counts in thousandths, as without a decimal point


@dataclass
class FanucFrames:
    """Keeps the rotation (centre in m, degrees), the scales (axis: factor) about a place (m), and the mirrors (axis: place in
    m) in force; a program is mirrored first, then stretched, then turned."""

    state: ControlModes
    centre: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    angle: float | None = None
    mirrors: dict[int, float] = field(default_factory=dict)
    scales: dict[int, float] = field(default_factory=dict)
    scale_centre: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])

    def take(self, number: int, word: float, places: Places, *, numbers: Mapping[str, float]) -> bool:
        """Carry out G68, G68.2, G53.1, G69, G51, G50, G51.1 or G50.1; return whether the places of the block belong to it."""
        axes = {i: self.state.length(i, places[letter][1]) for letter, i in AXES.items() if letter in places}
        if word == 68.2:
            tilt_by_euler(self.state, number, places)
            return True
        if word == 53.1:
            self.state.tilted.is_reached = True
            return False
        if word == 69 and self.state.tilted.matrix is not None:
            cancel(self.state)
            return False
        if word == 68 and "CR" in places:
            self._turn(number, axes, places["CR"][1])
        elif word == 51:
            self._stretch(number, axes, numbers, places)
        elif word == 50 and self.scales:
            self.scales = {}
        elif word == 51.1:
            self.mirrors |= axes
        elif word == 69 and self.angle is not None:
            self.angle = None
        elif word == 50.1 and self.mirrors:
            self.mirrors = {i: position for i, position in self.mirrors.items() if axes and i not in axes}
        else:  # without an angle a word of older controls; what is not in force cannot end
            self.state.remarks.without_motion(number, f"G{word:g}")
            return False
        self._lay()
        return word not in (50, 69)

    def _stretch(self, number: int, axes: dict[int, float], numbers: Mapping[str, float], places: Places) -> None:
        factors = {i: places[letter][1] for letter, i in CENTER.items() if letter in places}
        factors = factors or dict.fromkeys(range(3), numbers.get("P", 0.0))
        self.scales = {i: value / 1000 if value == int(value) and abs(value) >= MIN_THOUSANDTHS else value
                       for i, value in factors.items()}
        if self.state.incremental or not all(self.scales.values()):
            self.state.remarks.fault(number, 1, "G51 without a factor P or I, J, K, with a factor of zero, or under G91, is "
                                     "not computed; program G90 G51 X Y Z P")
        current_place = self.state.programmed
        self.scale_centre = [axes.get(i, current_place[i]) for i in range(3)]

    def _turn(self, number: int, axes: dict[int, float], angle: float) -> None:
        if self.state.incremental:
            self.state.remarks.fault(number, 1, "G68 under G91: whether its angle and centre are increments is a setting of "
                                     "the control; program it under G90")
        current_place = self.state.programmed
        plane = PLANES[self.state.plane]
        self.centre = [axes.get(i, current_place[i]) if i in plane else 0.0 for i in range(3)]
        self.angle = angle

    def _lay(self) -> None:
        frame = self.state.frame
        frame.reset()
        if self.angle is not None:
            frame.translate(self.centre)
            frame.multiply(rotation(3 - sum(PLANES[self.state.plane]), self.angle))
            frame.translate([-c for c in self.centre])
        if self.scales:
            frame.translate(self.scale_centre)
            frame.multiply(diagonal(self.scales))
            frame.translate([-c for c in self.scale_centre])
        for axis, position in self.mirrors.items():
            step = [position if i == axis else 0.0 for i in range(3)]
            frame.translate(step)
            frame.multiply(diagonal({axis: -1.0}))
            frame.translate([-s for s in step])
