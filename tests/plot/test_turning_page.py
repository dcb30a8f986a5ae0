"""The page of a turning cut in a browser: the chart, the width that is stable at every speed, and where it comes from."""

import re

import numpy as np
import pytest

from toolpoint.app.main import main
from toolpoint.cutting.stability.methods.turning import least_width
from toolpoint.io.binary import hdf5
from toolpoint.vibration import Modes


@pytest.mark.slow
def test_the_page_shows_the_chart_and_the_response_with_its_least_real_part(opened, tmp_path, capsys):
    mass, frequency, ratio = 2.0, 150.0, 0.03
    hdf5.write(Modes([frequency], ratio, np.array([[1 / np.sqrt(mass)]]), ("bar:+x",)), tmp_path / "bar.h5")
    main(["turn", "--modes", str(tmp_path / "bar.h5"), "--kf", "1500", "-o", str(tmp_path / "page")])
    least = 1e3 * least_width(mass * (2 * np.pi * frequency) ** 2, ratio, 1500e6)
    said = re.search(r"stable at every speed │\D*below ([\d.]+)", " ".join(capsys.readouterr().out.split()))
    assert 0 <= 1 - float(said[1]) / least < 2e-3  # rounded to the safe side
    seen = opened((tmp_path / "page/index.html").read_text(), reduced_motion="reduce")
    seen.wait("'stability' in window.toolpointCharts && 'oriented' in window.toolpointCharts")
    names = seen.page.evaluate("Array.from(window.toolpointCharts.stability.data, trace => trace.name)")
    assert list(dict.fromkeys(names)) == ["stable", "first limit", "stable at every speed", "best cut, with some margin"]
    assert seen.page.evaluate("window.toolpointCharts.stability._fullData[3].y[0]") == pytest.approx(least, rel=1e-6)
    title = "window.toolpointCharts.stability.layout.yaxis.title.text"
    assert seen.page.evaluate(title) == "Width of cut, mm"
    marked = seen.page.evaluate("window.toolpointCharts.oriented._fullData.filter(t => t.name === 'least real part')[0].x[0]")
    assert marked == pytest.approx(frequency * np.sqrt(1 + 2 * ratio), rel=1e-5)
    assert seen.errors == []
    assert len(seen.requests) == 1
