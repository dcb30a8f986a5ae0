"""The page of a chatter map in a browser: a map of every feed direction, the worst pose, and what is stable everywhere."""

import numpy as np
import pytest

from toolpoint.cutting import ZeroOrder
from toolpoint.pages.cuts.chatter_map import chatter_map_page
from toolpoint.studies.cuts.chatter_map import chatter_map


@pytest.mark.slow
@pytest.mark.parametrize("axes", [{"X": [-0.2, 0.0, 0.2], "Z": [0.0, 0.3]}, {"Z": [0.0, 0.1, 0.3]}, {"Z": [0.1]}])
def test_map_and_speeds_are_drawn(opened, vertical_drives, axes):
    found = chatter_map(vertical_drives, axes, speeds=np.linspace(900, 1600, 15), feed_angles=np.radians([0, 90]),
                        method=ZeroOrder())
    seen = opened(chatter_map_page(found, vertical_drives).html(), reduced_motion="reduce")
    drawn = ["speeds"] if max(map(len, axes.values())) == 1 else ["map", "speeds"]
    seen.wait(" && ".join(f"'{name}' in window.toolpointCharts" for name in drawn))
    lines = seen.page.evaluate("Array.from(window.toolpointCharts.speeds._fullData, t => Array.from(t.y))")
    np.testing.assert_allclose(lines[0], 1e3 * found.everywhere, rtol=1e-6)
    if "map" in drawn:
        names = seen.page.evaluate("Array.from(window.toolpointCharts.map.data, t => t.name)")
        assert names[:3] == ["worst direction", "feed at 0°", "feed at 90°"]
        shown = seen.page.evaluate("(trace => Array.from(trace.z || trace.y).flatMap(r => r.length ? Array.from(r) : r))"
                                   "(window.toolpointCharts.map._fullData[0])")
        np.testing.assert_allclose(np.sort(shown), np.sort(1e3 * found.lowest.min(axis=-1), axis=None), rtol=1e-6)
    assert str(found.worst()) in seen.page.content()
    assert seen.errors == []
    assert len(seen.requests) == 1
