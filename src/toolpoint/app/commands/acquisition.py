"""Command about inputs for live tests: devices."""

from __future__ import annotations

from toolpoint.acquisition import list_devices
from toolpoint.app.declare import command
from toolpoint.app.frame import Frame


@command(page=False)
def devices(run: Frame) -> None:
    """List the inputs that can be recorded from: sound cards, NI boards, and what is missing for either.

    Their addresses are those of --device in `toolpoint tap --live` and `toolpoint listen --live`.
    """
    run.show(list_devices())
