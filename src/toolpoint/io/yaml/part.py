"""Part: what every key of a file that holds keys is made of."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class Part(BaseModel):
    """A part of a file: unknown keys are faults, values cannot be changed."""

    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)
