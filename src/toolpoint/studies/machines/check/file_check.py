"""Doubts about any part that a file describes: servo, components, cut, a robot's datasheet."""

from __future__ import annotations

from toolpoint._doubt import Doubt
from toolpoint.cutting.description import CuttingDescription
from toolpoint.drives.description import DriveDescription
from toolpoint.machine.components import Components
from toolpoint.machine.robot.datasheet import RobotDatasheet
from toolpoint.studies.machines.check.component_doubts import question_components
from toolpoint.studies.machines.check.cut_doubts import question_cut
from toolpoint.studies.machines.check.datasheet_doubts import question_datasheet
from toolpoint.studies.machines.check.servo_doubts import question_servo


def question_part(part: object) -> tuple[Doubt, ...]:
    """Return doubts about numbers of a described part that are possible and hardly meant; none for other kinds.

    Examples
    --------
    >>> from toolpoint.machine.description import BodyDescription
    >>> question_part(BodyDescription(100.0))
    ()
    """
    if isinstance(part, RobotDatasheet):
        return question_datasheet(part)
    if isinstance(part, DriveDescription):
        return question_servo(part)
    if isinstance(part, Components):
        return question_components(part)
    return question_cut(part) if isinstance(part, CuttingDescription) else ()
