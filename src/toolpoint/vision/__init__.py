"""Vision: video in, displacement, mode shapes and magnified motion out. The names below are loaded on first use."""

from __future__ import annotations

from typing import TYPE_CHECKING

from toolpoint._exports import export_lazily

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

__getattr__, __dir__ = export_lazily(__name__, {
    "clip": ("Clip", "Region", "clip_of"),
    "displacement.background": ("without_shake",),
    "displacement.lucas_kanade": ("LucasKanade",),
    "displacement.measure": ("Scan", "measure", "scan"),
    "displacement.phase": ("LocalPhase",),
    "displacement.points": ("choose_points", "grid_windows"),
    "displacement.quality": ("judge_quality",),
    "displacement.result": ("DisplacementField",),
    "displacement.templates": ("TemplateProducts",),
    "magnification.edges": ("overlay as overlay_edges",),
    "magnification.phase_based": ("PhaseMagnification",),
    "magnification.warp": ("ShapeWarp",),
    "magnification.writing": ("write_frames",),
    "modes.bodies": ("BodyMotion", "fit_bodies"),
    "modes.decay": ("find_decay",),
    "modes.full_field": ("full_field",),
    "modes.projection": ("point_shapes",),
    "modes.views": ("join_views",),
    "reading.files": ("read as read_clip",),
    "view": ("View",),
})
