"""Rotation, mirror and tilted plane of Fanuc controls: G68 X Y R, G68.2 and G69, G51.1 and G50.1."""

from __future__ import annotations

from dataclasses import dataclass, field

from toolpoint.io.program.control_modes import ControlModes, Places
from toolpoint.io.program.program_frame import AXES, PLANES, diagonal, rotation
from toolpoint.io.program.tilted_planes import cancel, tilt_by_euler


@dataclass
class FanucFrames:
    """Keeps the rotation (centre in m, degrees) and the mirrors (axis: place in m) in force; a program is mirrored first."""

    state: ControlModes
    centre: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    angle: float | None = None
    mirrors: dict[int, float] = field(default_factory=dict)

    def take(self, number: int, word: float, places: Places) -> bool:
        """Carry out G68, G68.2, G53.1, G69, G51.1 or G50.1; return whether the places of the block belong to it."""
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
        return word != 69

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
        for axis, position in self.mirrors.items():
            step = [position if i == axis else 0.0 for i in range(3)]
            frame.translate(step)
            frame.multiply(diagonal({axis: -1.0}))
            frame.translate([-s for s in step])
