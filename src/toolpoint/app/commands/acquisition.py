"""Command about inputs for live tests: devices."""

from __future__ import annotations

from typing import Annotated

from toolpoint import io, studies
from toolpoint.acquisition import list_devices
from toolpoint.app.declare import Help, Reading, command
from toolpoint.app.frame import Frame
from toolpoint.app.values import SourceFile
from toolpoint.io.quantities.written import read_mass

Mass = Annotated[float, Reading(read_mass, "a mass, for example 1.25kg")]


@command(page=False)
def devices(run: Frame, *,
            hammer: Annotated[SourceFile | None, Help("Blows on a free mass (the test file of a live test, YAML): the "
                                                      "sensitivity of the hammer, by F = m a.", needs="--mass")] = None,
            mass: Annotated[Mass | None, Help("That mass, with its accelerometer.", metavar="1.25kg",
                                              needs="--hammer")] = None) -> None:
    """List the inputs that can be recorded from, with what is missing for them; or calibrate a hammer by a free mass.

    The addresses are those of --device in `toolpoint tap --live` and `toolpoint listen --live`.
    """
    if hammer is None or mass is None:
        run.show(list_devices())
        return
    records, description = io.read_hammer_test([hammer])
    stated = next((part.sensitivity for part in description.channels if part.quantity == "force"), None)
    run.show(studies.calibrate_on_mass(records, mass, duration=description.block, sensitivity=str(stated or "")))
