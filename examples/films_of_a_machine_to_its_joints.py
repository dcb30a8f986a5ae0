"""Two films of a small mill to its soft joints and its updated model (as `toolpoint video FILMS --machine M --update U`)."""

from importlib import resources

import numpy as np

from toolpoint.io import read_machine
from toolpoint.studies import (
    FILMED_TRUTH,
    film_machine,
    magnify_motion,
    rank_interfaces,
    seen_places,
    study_videos,
    update_from_videos,
)
from toolpoint.vision import View
from toolpoint.vision.rendering.scene import Camera


def main() -> float:
    """Return the largest relative difference of an updated number to the one of the mill that was filmed."""
    with resources.as_file(resources.files("toolpoint.app") / "machines" / "small_mill.yaml") as path:
        model = read_machine(path)
    mill, rng = model.with_values(dict(FILMED_TRUTH)), np.random.default_rng(1)
    films = [film_machine(mill, View.of_plane(plane, 2.5e-3, (192.0, 400.0)), f"spindle_nose:+{plane[0]}", rng=rng,
                          camera=Camera(shape=(432, 384))) for plane in ("xz", "yz")]
    study = study_videos([film.clip for film in films], model, views=[film.view for film in films], band=(5.0, 100.0))
    print(f"points of the machine that the first film shows: {', '.join(map(str, seen_places(model, study.videos[0])))}")
    print(rank_interfaces(model, study.videos).table())
    update = update_from_videos(model, study.videos)
    print(update.table())
    frame = next(magnify_motion(study.videos[0], 20.0))  # all of them are written by `vision.write_frames`
    print(f"frames of the magnified film: {' x '.join(map(str, frame.shape))} pixels")
    return max(abs(update.machine.value(path) / value - 1) for path, value in FILMED_TRUTH.items())


if __name__ == "__main__":
    main()
