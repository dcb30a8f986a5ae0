"""The command video: modes from one or more videos, interfaces of a machine ranked and updated by them, motion magnified."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from toolpoint._check import ToolpointError
from toolpoint.app.frame import Frame, frame
from toolpoint.app.options import BAND, FILE, JSON, NEW_FILE, OUTPUT, REPLACE, band_of


@click.command()
@click.argument("files", nargs=-1, required=True, type=FILE)
@click.option("--fps", required=True, type=float, help="True frames per second of the camera (not of the player).")
@click.option("--shape", metavar="ROWSxCOLUMNS", help="Shape of plain binary frames (.raw, .bin).")
@click.option("--bits", type=click.IntRange(8, 16), help="Bits of a pixel of raw frames.")
@click.option("--row-delay", type=float, default=0.0, help="Rolling shutter: microseconds between neighbouring rows.")
@click.option("--region", metavar="LEFT,TOP,WIDTH,HEIGHT", help="Part of the picture to use.")
@click.option("--background", multiple=True, metavar="LEFT,TOP,WIDTH,HEIGHT",
              help="Part that stands still and has texture: camera shake is taken off by it; several times.")
@click.option("--body", "bodies", multiple=True, metavar="NAME=LEFT,TOP,WIDTH,HEIGHT",
              help="Where a body is seen, from back to front; several times. With --machine found by itself.")
@click.option("--method", type=click.Choice(["templates", "lucas-kanade", "phase"]), default="templates", show_default=True,
              help="Of displacement.")
@click.option("--points", type=click.IntRange(10, 5000), default=300, show_default=True, help="Points on edges and corners.")
@click.option("--view", "views", multiple=True, type=click.Choice(["xz", "yz", "xy"]),
              help="Plane of each video; z (or y) is up.")
@click.option("--scale", type=float, help="Millimetres a pixel.")
@click.option("--origin", "origins", multiple=True, metavar="COLUMN,ROW", help="Where each video shows the machine's origin.")
@BAND
@click.option("--start", type=float, help="Start of the free decay, s; found where left out.")
@click.option("--stop", type=float, help="End of the free decay, s.")
@click.option("--record", type=FILE,
              help="Hammer or accelerometer record, FRFs or modes from beside the video: gives the poles.")
@click.option("--machine", type=FILE, help="Machine file: interfaces are ranked by the videos.")
@click.option("--update", "written", type=NEW_FILE, help="Update the machine to the videos and write it here.")
@click.option("--magnify", type=NEW_FILE, help="Write a magnified clip here (.mp4, .gif, .webp, or a folder of images).")
@click.option("--mode", "which", type=click.IntRange(1), default=1, show_default=True, help="Mode to magnify.")
@click.option("--factor", type=float, default=20.0, show_default=True, help="Of magnification.")
@click.option("--attenuation", type=click.FloatRange(0, 1), default=0.5, show_default=True,
              help="Of noise in the magnified clip.")
@click.option("--magnify-band", metavar="LOW:HIGH", callback=band_of,
              help="Magnify this band (Hz) by phase instead of a mode by its shape; patents are on record for that method.")
@click.option("-m", "--modes", "modes_file", type=NEW_FILE,
              help="Save the modes of the first video (HDF5): at the machine's points where there is one, else at the windows.")
@REPLACE
@OUTPUT
@JSON
def video(files: Sequence[Path], output: Path, as_json: bool, machine: Path | None, written: Path | None, magnify: Path | None,
          modes_file: Path | None, **options: Any) -> None:
    """Mode shapes, frequencies and damping from videos of a machine that rings after a blow.

    Videos (.mp4 .mov .avi .mkv, extra 'video'), folders of images, .npy or raw frames. Two videos of orthogonal planes and a
    machine file rank the machine's interfaces and update it.
    """
    if written is not None and machine is None:
        raise ToolpointError("--update: needs --machine, the machine to be updated")
    built = None
    if machine is not None:
        from toolpoint.io.yaml import machine_file

        built = machine_file.read(machine)
    with frame(output, as_json) as run:
        videos = [_study(run, path, number, built, options) for number, path in enumerate(files)]

        from toolpoint.io.binary import hdf5
        from toolpoint.io.yaml import machine_file
        from toolpoint.pages.video import video_page
        from toolpoint.studies.video.interfaces import rank_interfaces
        from toolpoint.studies.video.video_update import update_from_videos

        result: Any = None
        if built is not None:
            if written is None:
                result = rank_interfaces(built, videos)
            else:
                result = updated = update_from_videos(built, videos)
                machine_file.write(updated.machine.description, written)
        run.save(video_page(videos, result, warnings=run.warnings))
        if magnify is not None:
            _magnify(videos[0], magnify, options)
        if modes_file is not None:
            hdf5.write(_modes(videos[0], built), modes_file)
    if as_json:
        run.show_json({"videos": [study.to_dict() for study in videos],
                       "machine": None if result is None else result.to_dict()})
        return
    for study in videos:
        run.print_table(study)
    if result is not None:
        run.print_table(result)
    run.show_rest([note for study in videos for note in study.notes], {"Machine file": written, "Magnified clip": magnify,
                                                                          "Modes": modes_file})


def _study(run: Frame, path: Path, number: int, machine: Any, options: dict[str, Any]) -> Any:
    """Read and study one video."""
    from toolpoint.vision import Region, read_clip

    view = _view(options, number)
    region = None if options["region"] is None else Region.parse(options["region"])
    clip = read_clip(path, options["fps"], shape=_shape(options["shape"]), bits=options["bits"],
                     row_delay=1e-6 * options["row_delay"], region=region)

    from toolpoint.io.measured import frf_files, mode_files, record_files
    from toolpoint.studies.video.machine_view import body_regions
    from toolpoint.studies.video.record_poles import poles_of
    from toolpoint.studies.video.video_study import study_video
    from toolpoint.vision.modes.bodies import ORDERS, RIGID

    bodies = {name: Region.parse(box) for name, _, box in (text.partition("=") for text in options["bodies"])}
    if machine is not None and not bodies:
        bodies = body_regions(machine, view, clip.shape)
    poles = None
    if options["record"] is not None:
        file = options["record"]
        if mode_files.holds_modes(file):
            poles = poles_of(mode_files.read(file))
        else:
            try:
                poles = poles_of(record_files.read(file), options["band"])
            except ToolpointError as of_record:
                try:
                    poles = poles_of(frf_files.read(file), options["band"])
                except ToolpointError as of_responses:
                    raise ToolpointError(f"--record: {file.name} is read neither as a record ({of_record}) nor as responses "
                                         f"({of_responses})") from None
    with run.progress_of_parts() as progress:
        return study_video(clip, method=options["method"], points=options["points"], view=view,
                           background=[Region.parse(text) for text in options["background"]], bodies=bodies,
                           band=options["band"], start=options["start"], stop=options["stop"], poles=poles,
                           orders=ORDERS if machine is None else RIGID,
                           progress=lambda name, done, total: progress(name, done, max(total, done)))


def _view(options: dict[str, Any], number: int) -> Any:
    from toolpoint.vision import View

    planes, origins = options["views"] or ("xz",), options["origins"] or ("0,0",)
    plane, origin = planes[min(number, len(planes) - 1)], origins[min(number, len(origins) - 1)]
    try:
        column, row = (float(part) for part in origin.split(","))
    except ValueError:
        raise click.BadParameter(f"{origin!r}: write COLUMN,ROW, for example 640,700", param_hint="--origin") from None
    return View.of_plane(plane, None if options["scale"] is None else 1e-3 * options["scale"], (column, row))


def _shape(text: str | None) -> tuple[int, int] | None:
    if text is None:
        return None
    rows, cross, columns = text.partition("x")
    if not (cross and rows.isdigit() and columns.isdigit()):
        raise click.BadParameter(f"{text!r}: write ROWSxCOLUMNS, for example 720x1280", param_hint="--shape")
    return int(rows), int(columns)


def _magnify(study: Any, path: Path, options: dict[str, Any]) -> None:
    """Write the magnified clip: a mode by its shape, or a band by its phase."""
    from toolpoint.pages.video import shape_warp
    from toolpoint.vision import PhaseMagnification, write_frames

    if options["magnify_band"] is not None:
        low, high = options["magnify_band"]
        method = PhaseMagnification(low, high, options["factor"], options["attenuation"])
        write_frames(method.frames(study.scan), path)
        return
    if options["which"] > study.poles.count:
        raise ToolpointError(f"--mode: {options['which']}; the video has {study.poles.count} modes")
    warp = shape_warp(study)
    write_frames(warp.frames(options["which"] - 1, options["factor"], attenuation=options["attenuation"]), path)


def _modes(study: Any, machine: Any) -> Any:
    """Return the modes to be saved: at the machine's points on the bodies that are seen, else at the windows."""
    if machine is None:
        return study.modes
    from toolpoint.studies.video.video_update import seen_places

    return study.modes_at(seen_places(machine, study))
