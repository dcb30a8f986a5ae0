"""Modes from a video: poles by modal identification or from a record beside the camera, shapes by every window and body."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint._doubt import Doubt, mark_notes
from toolpoint._notebook import NotebookText
from toolpoint.machine import Machine
from toolpoint.modal_identification import Identification, identify
from toolpoint.studies.text_table import text_table
from toolpoint.studies.video.camera_motion import find_camera_motion
from toolpoint.studies.video.machine_view import body_regions
from toolpoint.studies.video.record_poles import part_poles
from toolpoint.studies.video.shape_modes import body_covariance, body_modes, window_modes
from toolpoint.studies.video.video_doubts import MIN_SEEN_SIGMA, has_smoothed_frames, video_doubts
from toolpoint.vibration import Dof, Modes
from toolpoint.vibration.geometry import Geometry
from toolpoint.vision.clip import Clip, Region
from toolpoint.vision.displacement.background import CameraMotion, without_camera
from toolpoint.vision.displacement.measure import Method, Scan, measure, scan
from toolpoint.vision.displacement.points import BLIND_SIGHT, choose_points, grid_windows
from toolpoint.vision.displacement.quality import Quality, judge_quality
from toolpoint.vision.displacement.result import DisplacementField
from toolpoint.vision.displacement.survey import Progress
from toolpoint.vision.displacement.templates import TemplateProducts
from toolpoint.vision.modes.artefacts import name_artefacts, shake_lines
from toolpoint.vision.modes.bodies import RIGID_ORDERS, BodyMotion, fit_bodies
from toolpoint.vision.modes.body_orders import ORDERS
from toolpoint.vision.modes.decay import FreeDecay, decay_of, find_decay
from toolpoint.vision.modes.full_field import FullField, full_field
from toolpoint.vision.modes.jumps import Jump, find_unbroken
from toolpoint.vision.modes.lines import alias_candidates, lamp_lines, lamps_alone, lamps_everywhere, name_line, name_modes
from toolpoint.vision.modes.pooling import pool_windows
from toolpoint.vision.modes.projection import PointShapes, count_transient_frames, point_shapes
from toolpoint.vision.modes.scatter import inflate_by_loss, inflate_by_windows
from toolpoint.vision.view import View

HEADER = ("mode", "frequency Hz", "± Hz", "damping %", "± %", "largest motion px", "seen", "if aliased Hz", "remark")
# Advice of an identification of measured responses that does not hold for the transforms of a decay.
_RESPONSE_ADVICE = ("half-power width", "no driving point", "responses fit below", "stated variance")
MIN_LINE_CYCLES = 0.9  # of the lowest line, in the length of the decay
LARGE_MOTION_PIXELS = 0.5  # from which windows are tracked in place of projected frames
MIN_POLE_WINDOWS = 12  # below which poles come from the points
# Share of the strongest mode below which compression makes lines, at most.
MAX_LOSS = 0.15
# Share of every body's motion that its windows do not share, from which a pole is no mode.
MAX_INCOHERENT_FRACTION = 0.5
FAINT_REMARK = "doubtful: faint, it may be noise"
COMPRESSION_REMARK = "doubtful: faint beside the strongest, compression makes such lines"


@dataclass(frozen=True, eq=False)
class VideoStudy(NotebookText):
    """Modes of a video, with its quality, decay and bodies.

    Parameters
    ----------
    scan : Scan
        The clip, its survey and its picture at rest.
    quality : Quality
    points : DisplacementField
        Of points on edges and corners, background motion taken off.
    decay : FreeDecay
    identification : Identification, optional
        Where the poles are the video's own.
    poles : Modes
        Frequencies, damping and their covariance; one Dof.
    names : tuple of str
        What each pole may be instead of a mode, empty for a mode.
    motion_sigma : (r,) floats
        Largest motion of each mode over its standard deviation.
    shapes : PointShapes
        Of the points.
    picture : FullField
        Of the whole picture.
    bodies : tuple of BodyMotion
    view : View
    source : str
        Where the poles come from: ``video`` or the record's name.
    doubts, notes : tuple of str
    """

    scan: Scan
    quality: Quality
    points: DisplacementField
    decay: FreeDecay
    identification: Identification | None
    poles: Modes
    names: tuple[str, ...]
    motion_sigma: FloatArray
    shapes: PointShapes
    picture: FullField
    bodies: tuple[BodyMotion, ...]
    view: View
    source: str = "video"
    doubts: tuple[Doubt, ...] = field(default=())
    notes: tuple[str, ...] = field(default=())

    @property
    def is_mode(self) -> np.ndarray:
        """Mask of the poles taken for modes of the machine, (r,) bools."""
        return np.array([not name for name in self.names], bool)

    @property
    def gives_damping(self) -> bool:
        """Whether damping can be stated: the clip carries amplitudes, or the poles come from a record."""
        return self.quality.accepts_amplitude or self.source != "video"

    @property
    def modes(self) -> Modes:
        """The modes at the measured directions of the points, labels 1, 2, ..; metres where the scale is known, else pixels."""
        modes = window_modes(self.poles, self.points, self.shapes, view=self.view)
        return modes.selected(np.flatnonzero(self.is_mode).tolist())

    @property
    def places(self) -> Geometry | None:
        """Places of the labels of `modes`, in the plane of the picture through the machine's origin; None without a scale."""
        if self.view.scale is None:
            return None
        return Geometry(dict(enumerate(self.view.locate(self.points.windows.centres), start=1)), [])

    def modes_at(self, places: Mapping[str | int, tuple[str, FloatArray]]) -> Modes:
        """Return the modes at places (3,) in m on bodies, by the motion of each: name to (body, place)."""
        modes = body_modes(self.poles, self.bodies, self.view, places=places)
        return modes.selected(np.flatnonzero(self.is_mode).tolist())

    def shape_covariance_at(self, places: Mapping[str | int, tuple[str, FloatArray]], *, floor: float) -> FloatArray:
        """Return the covariance E[e e^H] of the shapes of `modes_at`, (n_modes, n_dofs, n_dofs), m^2.

        Places of one body err together.

        floor : deviation of a body's motion over the root mean square of the shape that it has at least.
        """
        covariance = body_covariance(self.poles, self.bodies, self.view, places=places, floor=floor)
        return covariance[np.flatnonzero(self.is_mode)]

    def rows(self) -> list[list[str]]:
        """Return the table's rows, one a pole."""
        result = []
        rate = self.scan.clip.frame_rate
        lengths = np.sqrt((np.abs(self.shapes.shape) ** 2).sum(axis=1)).max(axis=0)
        for i in range(self.poles.count):
            alias_below, alias_above = alias_candidates(float(self.poles.frequency[i]), rate)
            widths = ("", "") if self.poles.covariance is None else (
                f"{self.poles.frequency_interval[i]:.2g}", f"{100 * self.poles.damping_interval[i]:.2g}")
            damping = (f"{100 * self.poles.damping_ratio[i]:.3f}", widths[1]) if self.gives_damping else ("refused", "")
            result.append([str(i + 1), f"{self.poles.frequency[i]:.3f}", widths[0], *damping, f"{lengths[i]:.4f}",
                           "no" if self.motion_sigma[i] < MIN_SEEN_SIGMA else f"{self.motion_sigma[i]:.0f} sigma",
                           f"{alias_below:.1f}, {alias_above:.1f}" if self.source == "video" else "", self.names[i]])
        return result

    def table(self) -> str:
        """Return doubts first, then poles, bodies and what was measured, as text."""
        lines = mark_notes(self.doubts)
        lines.append(text_table(f"Modes of {self.scan.clip.name} (poles from the {self.source})", HEADER, self.rows()))
        lines.append(f"displacement measured at {self.points.summary}")
        for body in self.bodies:
            orders = ", ".join(dict.fromkeys(body.orders))
            lines.append(f"body {body.name}: {body.windows} windows, motion taken as {orders}")
        return "\n".join(lines)

    def to_dict(self) -> dict[str, Any]:
        """Return the poles as plain data; damping None where it is refused."""
        damping = self.poles.damping_ratio.tolist() if self.gives_damping else [None] * self.poles.count
        result: dict[str, Any] = {
            "doubts": list(self.doubts), "frame_rate_hz": self.scan.clip.frame_rate, "source_of_poles": self.source,
            "frequency_hz": self.poles.frequency.tolist(), "damping_ratio": damping, "remark": list(self.names),
            "seen_sigma": self.motion_sigma.tolist(), "accepts_amplitude": self.quality.accepts_amplitude,
            "notes": list(self.notes),
            "bodies": {body.name: list(body.orders) for body in self.bodies}}
        if self.poles.covariance is not None:
            result["frequency_interval_hz"] = _finite(self.poles.frequency_interval)
            result["damping_interval"] = _finite(self.poles.damping_interval) if self.gives_damping else None
        return result

    def __repr__(self) -> str:
        return f"VideoStudy({self.scan.clip!r}, {int(self.is_mode.sum())} modes, {len(self.bodies)} bodies)"


def study_video(
    clip: Clip, *, method: str | Method = "templates", points: int = 300, view: View | None = None,
    background: Sequence[Region] = (), bodies: Mapping[str, Region] | None = None, band: tuple[float, float] | None = None,
    start: float | None = None, stop: float | None = None, poles: Modes | None = None, side: int = 16,
    orders: Sequence[str] | None = None, machine: Machine | None = None, progress: Progress | None = None,
) -> VideoStudy:
    """Return the modes in a video.

    Parameters
    ----------
    clip : Clip
        See `toolpoint.vision.read_clip`.
    method : str or method object
        Of displacement: ``templates``, ``lucas-kanade``, ``phase``.
    points : int
        Points on edges and corners.
    view : View, optional
        How the picture lies in the machine, and its scale.
    background : sequence of Region
        Parts that stand still: the camera's motion is taken off by them.
    bodies : name to Region, optional
        Where each body is seen, from back to front.
    band : (low, high), Hz, optional
        In which poles are looked for.
    start, stop : float, optional
        Of the free decay, s from the first frame.
    poles : Modes, optional
        From a hammer or accelerometer record beside the video: then only shapes come from it, also beyond half the frame rate.
    side : int
        Pixels of the windows of the whole picture.
    orders : of `ORDERS`
        Motions that a body may have, the likeliest is taken; all of them, for a machine `RIGID_ORDERS`, where left out.
    machine : Machine, optional
        Where its bodies are seen says where `bodies` are, where these are left out.
    progress : function of name, done, total

    Raises
    ------
    ToolpointError
        Where nothing in the picture shows motion, and for what the parts refuse.

    Examples
    --------
    Runs in ``examples/modes_from_a_clip.py``.
    """
    if machine is not None and not bodies:
        bodies = body_regions(machine, view or View(), clip.shape)
    scanned = scan(clip, progress)
    quality = judge_quality(scanned)
    regions = {name: region.within(scanned.clip.shape, f"bodies[{name!r}]") for name, region in (bodies or {}).items()}
    resting_regions = [region.within(scanned.clip.shape, "background") for region in background]
    shaken = measure(scanned, choose_points(scanned.reference, scanned.survey, points), method, progress=progress)
    camera = find_camera_motion(scanned, shaken, resting_regions, bodies=regions, side=side, method=method)
    field = _remove_camera(shaken, camera)
    all_windows = _all_windows(scanned, field, camera, side=side, method=method, progress=progress)
    decay, jumps = _decay(all_windows, regions, start, stop, is_smoothed=has_smoothed_frames(scanned, quality))
    lamps = lamps_everywhere(lamp_lines(scanned.survey.brightness, clip.frame_rate), scanned.survey.means, clip.frame_rate)
    used_poles, identification, pole_notes = _chosen_poles(poles, decay, all_windows, band=band, loss=quality.loss)
    skip = count_transient_frames(field, used_poles.poles, decay.first, stop=decay.stop)
    shapes = point_shapes(field, used_poles.poles, decay.first, stop=decay.stop, skip=skip)
    line = clip.frame_rate / len(decay.components)
    lamps = lamps_alone(lamps, used_poles, clip.frame_rate, resolution=line)
    names = ("",) * used_poles.count if poles is not None else name_modes(_with_shapes(used_poles, shapes), lamps,
                                                                          clip.frame_rate,
                                                                          resolution=line)
    if poles is None:
        names = tuple(name or ("below the band" if band and used_poles.frequency[i] < band[0] else "")
                      for i, name in enumerate(names))
        names = name_artefacts(_with_shapes(used_poles, shapes), names, clip.frame_rate, resolution=line,
                               is_lossy=clip.is_lossy,
                               shake=shake_lines(camera, clip.frame_rate))
    picture = _whole_picture(scanned, used_poles, decay, field=field, camera=camera, side=side, skip=skip, progress=progress)
    motion_sigma = _motion_sigma(shapes)
    names = _mark_doubtful(names, identification, motion_sigma, loss=quality.loss)
    moved = fit_bodies(picture.windows, picture.shapes, regions,
                       orders=tuple(orders or (ORDERS if machine is None else RIGID_ORDERS)),
                       counted=np.array([not name for name in names]), loss=quality.loss)
    if poles is None:
        names = _mark_incoherent(names, moved)
    doubts = video_doubts(scanned, quality, field, decay=decay, poles=used_poles, shapes=shapes, bodies=moved,
                          unseen=[i for i, name in enumerate(names) if motion_sigma[i] < MIN_SEEN_SIGMA
                                  and name in ("", FAINT_REMARK)],
                          of_record=poles is not None, jumps=jumps)
    notes = (*quality.notes, *pole_notes, *field.doubts,
             *(f"{name_line(f, clip.frame_rate)} at {f:.2f} Hz in the brightness" for f in lamps),
             *_advice(identification, names))
    return VideoStudy(scanned, quality, field, decay, identification, used_poles, names, motion_sigma, shapes, picture, moved,
                      view or View(),
                      "video" if poles is None else "record", doubts, tuple(dict.fromkeys(notes)))


def _all_windows(scanned: Scan, points: DisplacementField, camera: CameraMotion | None, *, side: int, method: str | Method,
                 progress: Progress | None) -> DisplacementField:
    """Return the field of windows side by side over the picture, for the poles: every pixel counts once; else the points."""
    # Windows without texture see no motion.
    windows = grid_windows(scanned.reference, scanned.survey, min(2 * side, min(scanned.clip.shape) // 4))
    windows = windows.selected(np.flatnonzero(windows.sight > BLIND_SIGHT))
    if len(windows.corners) < MIN_POLE_WINDOWS:
        return points
    return _remove_camera(measure(scanned, windows, method, progress=progress), camera)


def _decay(field: DisplacementField, bodies: Mapping[str, Region], start: float | None, stop: float | None, *,
           is_smoothed: bool) -> tuple[FreeDecay, tuple[Jump, ...]]:
    """Return the decay and its jumps: by all windows, or pooled by bodies where compression or little motion hides it."""
    if not is_smoothed:
        try:
            return find_unbroken(lambda lower, upper: find_decay(field, lower, upper), start, stop)
        except ToolpointError as error:
            reason = error
    pooled = pool_windows(field, bodies)
    try:
        return find_unbroken(lambda lower, upper: decay_of(pooled.copy(), field.frame_rate, start=lower, stop=upper), start,
                             stop,
                             smoothed=is_smoothed)
    except ToolpointError as error:
        raise error if is_smoothed else reason from None


def _remove_camera(field: DisplacementField, camera: CameraMotion | None) -> DisplacementField:
    return field if camera is None else without_camera(field, camera)


def _chosen_poles(poles: Modes | None, decay: FreeDecay, field: DisplacementField, *, band: tuple[float, float] | None,
                  loss: float) -> tuple[Modes, Identification | None, tuple[str, ...]]:
    """Return the poles of a record that the video shows, or the video's own with their identification, and notes."""
    if poles is not None:
        chosen, notes = part_poles(poles, decay)
        return chosen, None, notes
    return *_identify_poles(decay, field, band, loss=loss), ()


def _identify_poles(decay: FreeDecay, field: DisplacementField, band: tuple[float, float] | None, *, loss: float
                    ) -> tuple[Modes, Identification]:
    length = len(decay.components) / decay.frame_rate
    try:
        # Lines below the band stay: a strong mode of few cycles would be cut to a line or two, and lost with all its motion.
        result = identify(decay.responses(MIN_LINE_CYCLES / length),
                          band=band and (min(MIN_LINE_CYCLES / length, band[0]), band[1]))
    except ToolpointError as error:
        raise ToolpointError(f"video: motion is seen, but no decaying mode ({error}); strike the machine and film its ringing, "
                             "or give the poles of a record") from None
    modes = inflate_by_windows(result.modes, field, first=decay.first, count=len(decay.components))
    return inflate_by_loss(modes, loss), result


def _mark_doubtful(names: tuple[str, ...], identification: Identification | None, motion_sigma: FloatArray, *, loss: float
                   ) -> tuple[str, ...]:
    """Return the names with those poles marked that the decay or the picture does not support."""
    if identification is None:
        return tuple(name or ("" if motion_sigma[i] >= MIN_SEEN_SIGMA else FAINT_REMARK) for i, name in enumerate(names))
    unsure, sigma_min = identification.doubtful, min(loss, MAX_LOSS) * float(motion_sigma.max())
    return tuple(name or (FAINT_REMARK if unsure[i] or motion_sigma[i] < MIN_SEEN_SIGMA else COMPRESSION_REMARK
                          if motion_sigma[i] < sigma_min else "")
                 for i, name in enumerate(names))


def _mark_incoherent(names: tuple[str, ...], bodies: Sequence[BodyMotion]) -> tuple[str, ...]:
    """Return the names with those poles marked in which no body moves as one."""
    unshared_motion = [body.residual_fraction for body in bodies if body.residual_fraction.size]
    if not unshared_motion:
        return names
    return tuple(name or ("doubtful: no body moves as one in it" if unshared > MAX_INCOHERENT_FRACTION else "")
                 for name, unshared in zip(names, np.min(unshared_motion, axis=0), strict=True))


def _with_shapes(poles: Modes, shapes: PointShapes) -> Modes:
    flat = shapes.shape.reshape(-1, poles.count)
    return Modes(poles.frequency, poles.damping_ratio, flat, tuple(Dof(i + 1, "+x") for i in range(len(flat))), "unscaled",
                 covariance=poles.covariance)


def _whole_picture(scanned: Scan, poles: Modes, decay: FreeDecay, *, field: DisplacementField, camera: CameraMotion | None,
                   side: int, skip: int, progress: Progress | None) -> FullField:
    """Return the shapes of the whole picture: projected frames for small motion, tracked windows for large or shaken ones."""
    # Not the largest: a few noisy pixels would set the scale of the whole picture.
    size = float(np.quantile(np.abs(field.values - field.values.mean(axis=0)), 0.999))
    # Projection is linear in the brightness, which holds for small motion of a still camera alone.
    if size <= LARGE_MOTION_PIXELS and camera is None:
        return full_field(scanned, poles.poles, decay.first, side=side, stop=decay.stop, skip=skip, progress=progress)
    windows = grid_windows(scanned.reference, scanned.survey, side)
    tracked = _remove_camera(measure(scanned, windows, TemplateProducts(2 if camera is None else 4), progress=progress), camera)
    shapes = point_shapes(tracked, poles.poles, decay.first, stop=decay.stop, skip=skip)
    return FullField(tracked.windows, shapes, np.zeros((poles.count, 0, 0), complex))


def _motion_sigma(shapes: PointShapes) -> FloatArray:
    ratio = np.abs(shapes.shape) / np.maximum(shapes.deviation(), 1e-12)[:, :]
    used = shapes.covariance[:, 0, 0] + shapes.covariance[:, 1, 1] > 0
    # Together, not the luckiest point: root of the mean chi-squared, less what noise gives.
    square = (ratio[used] ** 2).sum(axis=(0, 1))
    return np.asarray(np.sqrt(np.maximum(square - 2 * used.sum(), 0.0)))


def _advice(identification: Identification | None, names: Sequence[str]) -> tuple[str, ...]:
    """Return the advice that holds for a decay: not that for responses, nor that for poles that are no modes."""
    if identification is None:
        return ()
    skipped = [f"mode {i + 1} " for i, name in enumerate(names) if name]
    return tuple(text for text in identification.advice if not any(part in text for part in (*_RESPONSE_ADVICE, *skipped)))


def _finite(values: FloatArray) -> list[float | None]:
    return [value if np.isfinite(value) else None for value in values.tolist()]
