"""The page of videos: doubts, modes, shapes moving, edges over the machine at rest, points with their spectra, interfaces."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from toolpoint._rounding import with_uncertainty
from toolpoint.plot import Chart, Listing, Notes, Picture, Report, Table
from toolpoint.plot.figures.measured.frf import bode
from toolpoint.plot.figures.video import picture_points, picture_shape, plot_response_error, point_spectra, spread_points
from toolpoint.studies.video.filmed_machine import shape_warp
from toolpoint.studies.video.interfaces import HEADER as INTERFACE_HEADER
from toolpoint.studies.video.interfaces import InterfaceRanking
from toolpoint.studies.video.response_error import FRAC_HEADER, SWEEP_HEADER, ResponseError
from toolpoint.studies.video.video_study import HEADER, VideoStudy
from toolpoint.studies.video.video_update import VALUES_HEADER, VideoUpdate
from toolpoint.studies.video.virtual_update import VirtualUpdate
from toolpoint.vision.displacement.points import MAX_POINT_DEVIATION
from toolpoint.vision.magnification.edges import overlay
from toolpoint.vision.magnification.warp import ShapeWarp
from toolpoint.vision.magnification.writing import eight_bits, encode_moving, encode_picture

# Pictures of one period of a shape; modes shown; pixels of the longer side of a picture; frames of the clip.
PERIOD_PICTURES, MAX_SHOWN_MODES, MAX_PICTURE_SIDE, MAX_CLIP_PICTURES = 12, 4, 720, 36
MAX_DRAWN_PAIRS, MIN_DRAWN_RATIO = 4, 1e-6  # pairs of measured responses, the strongest; of the largest, the least one
# Largest motion of a drawn shape, as a fraction of the picture's longer side.
DRAWN_MOTION_FRACTION = 0.03


def video_page(videos: Sequence[VideoStudy], result: VideoUpdate | InterfaceRanking | None = None, *,
               warnings: Sequence[str] = ()) -> Report:
    """Return the page of one or more videos, with the ranking and update of a machine where there is one.

    Examples
    --------
    Runs in ``examples/modes_from_a_clip.py``.
    """
    names = ", ".join(video.scan.clip.name for video in videos)
    report = Report("Modes from video", " ".join(map(_answer, videos)), subtitle=names)
    doubts = [*warnings, *(f"{video.scan.clip.name}: {text}" for video in videos for text in video.doubts)]
    further_doubts = [] if result is None else [text for text in result.doubts
                                                if not any(text in video.doubts for video in videos)]
    report = report.with_doubts(*further_doubts, *doubts)
    if result is not None:
        report = _machine(report, result)
    for number, video in enumerate(videos, start=1):
        report = _video(report, video, number)
    notes = list(dict.fromkeys(note for video in videos for note in video.notes))
    return report.with_assumptions(*notes, *dict.fromkeys(line for video in videos for line in _assumptions(video)))


def _assumptions(video: VideoStudy) -> list[str]:
    """Return the assumptions on which the modes of any video rest."""
    clip = video.scan.clip
    source = (f"of a free decay, on {clip.frame_rate:g} frames/s: a rate that is off by a per cent moves every frequency by "
              "that per cent" if video.source == "video" else f"from the record {video.source}")
    folded = [] if video.source != "video" else [
        f"a mode above half the frame rate ({clip.frame_rate / 2:g} Hz) is seen at a lower frequency, and nothing in the clip "
        "tells it from one that is there: the table says which it may be; a record beside the camera or another rate decides"]
    return [f"{clip.name or 'the clip'}: poles {source}", *folded,
            "shapes are motion in the plane of the picture; motion towards the camera is not seen"]


def _answer(video: VideoStudy) -> str:
    """Return the modes of a video with the intervals of their frequencies."""
    mode_indices = np.flatnonzero(video.is_mode)
    name = video.scan.clip.name or "The clip"
    if not mode_indices.size:
        return f"{name}: no mode is seen."
    half_width = video.poles.frequency_interval if video.poles.covariance is not None else None
    parts = [with_uncertainty(float(video.poles.frequency[i]), None if half_width is None else float(half_width[i]), "Hz")
             for i in mode_indices[:4].tolist()]
    further_text = f" and {mode_indices.size - 4} more" if mode_indices.size > 4 else ""
    return (f"{name}: {mode_indices.size} mode{'s' if mode_indices.size > 1 else ''}, "
            f"{', '.join(parts)}{further_text}{'' if half_width is None else ' (95 %)'}.")


def virtual_update_page(result: VirtualUpdate, text: str, name: str, *, warnings: Sequence[str] = ()) -> Report:
    """Return the page of virtual videos: what the videos say, and responses of the truth beside those before and after."""
    report = video_page(result.videos, result.update, warnings=warnings)
    charts = []
    for truth, original, updated, (frac_before, frac_after) in zip(result.truth, result.before_update, result.after_update,
                                                                   result.frac, strict=True):
        charts.append(Chart(bode({"truth": truth, "before": original, "updated": updated},
                                 title=f"{truth.outputs[0]}: FRAC before {frac_before:.3f}, updated {frac_after:.4f}")))
    first_sections, later_sections = report.sections[:2], report.sections[2:]
    report = replace(report, title="A mill updated from two videos", sections=first_sections).with_section(
        "Responses", *charts, *_error_parts(result.error))
    report = replace(report, sections=(*report.sections, *later_sections))
    notes = result.update.machine.description.assumptions
    return report.with_section("Inputs", Notes(list(notes), "assumed"), Listing(f"Machine file {name}", text))


def _error_parts(error: ResponseError) -> list[Chart | Table]:
    """Return the error of the responses over each joint parameter, as a chart and a table."""
    return [Chart(plot_response_error(error), "Error of the responses over each joint parameter, the others as they are: a "
                  "curve that stays level is a parameter that these responses cannot tell.", "response-error"),
            Table(SWEEP_HEADER, error.rows(), "What moves the error most first.")]


def shape_factor(video: VideoStudy, mode: int, share: float = DRAWN_MOTION_FRACTION) -> float:
    """Return the factor at which the largest motion of a mode is a share of the picture's longer side."""
    # A window that hardly sees the mode has its largest motion from noise: the factor is that of clear windows.
    is_clear = video.shapes.deviation().max(axis=1)[:, mode] < 0.2 * np.abs(video.shapes.shape[:, :, mode]).max()
    motion = np.sqrt((np.abs(video.shapes.shape[:, :, mode]) ** 2).sum(axis=1))
    largest = float(motion[is_clear].max()) if is_clear.any() else float(motion.max())
    return float(min(1e4, share * max(video.scan.clip.shape) / max(largest, 1e-9)))


def _machine(report: Report, result: VideoUpdate | InterfaceRanking) -> Report:
    ranking = result.ranking if isinstance(result, VideoUpdate) else result
    report = report.with_section("Interfaces", Table(INTERFACE_HEADER, ranking.rows(), "The softest in these modes first."))
    if isinstance(result, VideoUpdate):
        rows = [["modes", f"MAC {after.mac.min():.3f} at least, frequencies within "
                 f"{100 * float(np.abs(after.frequency_error).max()):.2g} %"] for after in result.update.all_after
                if after.measured.size]
        report = report.with_section("Updated machine", result.update.fit.status, Table(VALUES_HEADER, result.rows()),
                                     Table(["after the update", "agreement"], rows))
        report = _measured_responses(report, result)
    return report


def _measured_responses(report: Report, result: VideoUpdate) -> Report:
    """Return the report with measured responses beside the machine's, or with why there are none."""
    if result.responses is None:
        return report.with_section("Measured responses", Notes([result.response_note], "note"))
    named = {"measured": result.responses.measured, "before": result.responses.before_update,
             "updated": result.responses.after_update}
    # The strongest pairs alone: between planes that do not couple there is only rounding to draw.
    strength = np.abs(result.responses.measured.values).max(axis=0)
    order = np.argsort(-strength, axis=None)[:MAX_DRAWN_PAIRS]
    charts = [Chart(bode({name: frf.selected([int(row)], [int(column)]) for name, frf in named.items()}))
              for row, column in zip(*np.unravel_index(order, strength.shape), strict=True)
              if strength[row, column] > MIN_DRAWN_RATIO * strength.max()]
    return report.with_section("Measured responses", Table(FRAC_HEADER, result.responses.rows()), *charts,
                               *_error_parts(result.responses.error))


def _video(report: Report, video: VideoStudy, number: int) -> Report:
    clip, field = video.scan.clip, video.points
    title = clip.name or f"video {number}"
    picture = encode_picture(eight_bits(video.scan.reference.picture.astype(np.uint16) if clip.source.bits > 8
                                        else np.clip(video.scan.reference.picture + 0.5, 0, 255).astype(np.uint8)), "jpeg")
    report = report.with_section(f"{title}: modes", Table(HEADER, video.rows()), _clip(video))
    warp, modes = shape_warp(video), np.flatnonzero(video.is_mode)[:MAX_SHOWN_MODES]
    for i in modes.tolist():
        report = report.with_section(f"{title}: {video.poles.frequency[i]:.2f} Hz", *_shape_parts(video, warp, i, picture))
    chosen = spread_points(field)
    highest = min(clip.frame_rate / 2, 2.5 * float(video.poles.frequency.max()))
    chart = Chart(picture_points(picture, clip.shape, field, chosen=chosen), "Click a point for its spectrum.",
                  f"points-{number}")
    spectra = point_spectra(field, chosen, f"points-{number}", first=video.decay.first, highest=highest,
                            name=f"spectra-{number}")
    return report.with_section(f"{title}: points", chart, spectra)


def _shape_parts(video: VideoStudy, warp: ShapeWarp, mode: int, picture: bytes) -> list[Any]:
    factor = shape_factor(video, mode)
    reference = video.scan.reference.picture
    phase = _real_phase(video, mode)
    frames = [_shrink(warp.deform_reference(mode, factor, phase * np.exp(2j * np.pi * k / PERIOD_PICTURES)))
              for k in range(PERIOD_PICTURES)]
    edges = overlay(reference, warp.deform_reference(mode, factor, phase).astype(float))
    windows, shapes = video.picture.windows, video.picture.shapes
    lengths = shapes.deviation()[:, :, mode].max(axis=1)
    is_clear = (windows.bound[:, 0] <= MAX_POINT_DEVIATION) & (lengths < 0.25
                                                               * float(np.abs(video.shapes.shape[:, :, mode]).max()))
    parts: list[Any] = [
        Picture(encode_moving(frames, 16), f"the shape at {video.poles.frequency[mode]:.2f} Hz, moving",
                f"Motion of this mode alone, {factor:.0f} times its largest in the clip."),
        Picture(encode_picture(_shrink(edges), "webp"), "edges of the deformed machine over the machine at rest",
                "Edges at rest in blue, deformed in red.")]
    if is_clear.any():
        chart = picture_shape(picture, video.scan.clip.shape, windows.centres[is_clear],
                              shape_values=shapes.shape[is_clear][:, :, mode])
        parts.append(Chart(chart, f"Shape of {int(is_clear.sum())} windows that see it clearly, lines to where they move."))
    return parts


def _real_phase(video: VideoStudy, mode: int) -> complex:
    """Return the turn that makes the shape real where it is largest."""
    # Each square turns by twice its phase, whatever the sign of the motion; windows count by what they know.
    square = (video.shapes.shape[:, :, mode] ** 2 / np.maximum(video.shapes.deviation()[:, :, mode] ** 2, 1e-12)).sum()
    return complex(np.exp(-0.5j * np.angle(square)))


def _clip(video: VideoStudy) -> Picture:
    """Return the first periods of the decay as they were filmed."""
    rate = video.scan.clip.frame_rate
    lowest = float(video.poles.frequency.min())
    step = max(1, round(3 * rate / lowest / MAX_CLIP_PICTURES))
    frames = [_shrink(frame) for frame in _clip_pictures(video, step)]
    return Picture(encode_moving(frames, 16, quality=45), "the clip", f"The clip itself, every {step}. frame from the blow on.")


def _clip_pictures(video: VideoStudy, step: int) -> Iterator[np.ndarray]:
    """Yield every step-th frame from the blow on."""
    frame_index, end_frame = 0, video.decay.first + step * MAX_CLIP_PICTURES
    for frames in video.scan.clip.chunks():
        for k, frame in enumerate(frames, start=frame_index):
            if video.decay.first <= k < end_frame and (k - video.decay.first) % step == 0:
                yield frame
        frame_index += len(frames)
        if frame_index >= end_frame:
            return


def _shrink(frame: np.ndarray) -> np.ndarray:
    """Return a frame of at most `MAX_PICTURE_SIDE` pixels, by means of whole blocks."""
    picture = eight_bits(frame)
    # Rounded up: a picture one pixel too large is halved, not left as it is.
    side = -(-max(picture.shape[:2]) // MAX_PICTURE_SIDE)
    if side == 1:
        return picture
    rows, columns = picture.shape[0] // side * side, picture.shape[1] // side * side
    cut = picture[:rows, :columns].reshape(rows // side, side, columns // side, side, -1).mean(axis=(1, 3))
    return np.ascontiguousarray((cut[..., 0] if picture.ndim == 2 else cut) + 0.5).astype(np.uint8)
