"""What several files of these tests look at."""

import numpy as np
import pytest
import video_scenes as scenes

from toolpoint.vision.displacement.measure import scan


@pytest.fixture(scope="session")
def case():
    """The filmed C-frame and its scan."""
    rng = np.random.default_rng(11)
    scene = scenes.c_frame(rng)
    return scene, scan(scenes.filmed(scene, rng))
