"""Vision: video in, displacement, mode shapes and magnified motion out. The names below are loaded on first use."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from toolpoint.vision.clip import Clip, Region, clip_of
    from toolpoint.vision.displacement.background import without_shake
    from toolpoint.vision.displacement.lucas_kanade import LucasKanade
    from toolpoint.vision.displacement.measure import Scan, measure, scan
    from toolpoint.vision.displacement.phase import LocalPhase
    from toolpoint.vision.displacement.points import choose_points, grid_windows
    from toolpoint.vision.displacement.quality import judge_quality
    from toolpoint.vision.displacement.result import DisplacementField
    from toolpoint.vision.displacement.templates import TemplateProducts
    from toolpoint.vision.magnification.edges import overlay as overlay_edges
    from toolpoint.vision.magnification.phase_based import PhaseMagnification
    from toolpoint.vision.magnification.warp import ShapeWarp
    from toolpoint.vision.magnification.writing import write_frames
    from toolpoint.vision.modes.bodies import BodyMotion, fit_bodies
    from toolpoint.vision.modes.decay import find_decay
    from toolpoint.vision.modes.full_field import full_field
    from toolpoint.vision.modes.projection import point_shapes
    from toolpoint.vision.modes.views import join_views
    from toolpoint.vision.reading.files import read as read_clip
    from toolpoint.vision.view import View

__all__ = [
    "BodyMotion", "Clip", "DisplacementField", "LocalPhase", "LucasKanade", "PhaseMagnification", "Region", "Scan", "ShapeWarp",
    "TemplateProducts", "View", "choose_points", "clip_of", "find_decay", "fit_bodies", "full_field", "grid_windows",
    "join_views", "judge_quality", "measure", "overlay_edges", "point_shapes", "read_clip", "scan", "without_shake",
    "write_frames"]

_HOME = {
    "Clip": ("clip", "Clip"), "Region": ("clip", "Region"), "clip_of": ("clip", "clip_of"), "View": ("view", "View"),
    "without_shake": ("displacement.background", "without_shake"),
    "LucasKanade": ("displacement.lucas_kanade", "LucasKanade"), "LocalPhase": ("displacement.phase", "LocalPhase"),
    "TemplateProducts": ("displacement.templates", "TemplateProducts"), "Scan": ("displacement.measure", "Scan"),
    "measure": ("displacement.measure", "measure"), "scan": ("displacement.measure", "scan"),
    "choose_points": ("displacement.points", "choose_points"), "grid_windows": ("displacement.points", "grid_windows"),
    "judge_quality": ("displacement.quality", "judge_quality"),
    "DisplacementField": ("displacement.result", "DisplacementField"),
    "overlay_edges": ("magnification.edges", "overlay"), "ShapeWarp": ("magnification.warp", "ShapeWarp"),
    "PhaseMagnification": ("magnification.phase_based", "PhaseMagnification"),
    "write_frames": ("magnification.writing", "write_frames"), "BodyMotion": ("modes.bodies", "BodyMotion"),
    "fit_bodies": ("modes.bodies", "fit_bodies"), "find_decay": ("modes.decay", "find_decay"),
    "full_field": ("modes.full_field", "full_field"), "point_shapes": ("modes.projection", "point_shapes"),
    "join_views": ("modes.views", "join_views"), "read_clip": ("reading.files", "read")}


def __getattr__(name: str) -> Any:
    if name in _HOME:
        module, verb = _HOME[name]
        return getattr(importlib.import_module(f"toolpoint.vision.{module}"), verb)
    raise AttributeError(f"module 'toolpoint.vision' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOME})
