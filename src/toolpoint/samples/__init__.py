"""Sample files: small virtual measurements whose truth is known, with the faults that real ones have. Loaded on first use."""

from __future__ import annotations

from typing import TYPE_CHECKING

from toolpoint._exports import export_lazily

if TYPE_CHECKING:
    from toolpoint.samples.kinds import KINDS, SampleSet, write_samples

__all__ = ["KINDS", "SampleSet", "write_samples"]

__getattr__, __dir__ = export_lazily(__name__, {"kinds": ("KINDS", "SampleSet", "write_samples")})
