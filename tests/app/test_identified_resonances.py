"""The page of an identification says which modes stand out and which are doubtful."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from toolpoint.modal_identification import Resonance, identify
from toolpoint.pages.measured.identification import identification_page
from toolpoint.vibration import Frf, Modes, frequency_response


@pytest.mark.slow
def test_page_names_modes_that_stand_out_and_doubtful_ones():
    rng = np.random.default_rng(0)
    modes = Modes([20.0, 45.0, 60.0], 0.02, [[1.0, 0.5, 1.0], [0.4, -0.6, 0.2]], ["1:+x", "2:+x"])
    frf = frequency_response.modal(modes, np.linspace(5, 90, 800), None, inputs=["1:+x"])
    noisy = frf.values * (1 + 0.002 * rng.normal(size=frf.values.shape))
    found = identify(Frf(frf.frequency, noisy, frf.outputs, frf.inputs))
    assert found.modes.count == 3
    html = identification_page(found, None, ["a.txt"]).html()
    assert html.count(">stands out<") == len(found.dominant) > 0 and ">doubtful<" not in html
    unsure = (Resonance((0, 1), 1, 0.9), Resonance((2,), 2, 0.3, doubtful=True))
    html = identification_page(replace(found, resonances=unsure), None, ["a.txt"]).html()
    assert html.count(">stands out<") == 1 and html.count(">doubtful<") == 2
    lines = replace(found, resonances=unsure).table().split("\n")
    listed = json.loads(json.dumps(replace(found, resonances=unsure).to_dict(), allow_nan=False))
    assert (listed["stands_out"], listed["doubtful"]) == ([False, True, False], [False, False, True])
    assert listed["share"] == [0.9, 0.9, 0.3] and listed["frequency_interval_hz"] == found.modes.frequency_interval.tolist()
    assert [line[-1] in "*?" and line[-1] for line in lines[1:]] == [False, "*", "?"]


def test_an_interval_that_is_unknown_is_said_to_be():
    modes = Modes([20.0, 45.0], 0.02, [[1.0, 0.5]], ["1:+x"])
    frf = frequency_response.modal(modes, np.linspace(5, 90, 400))
    found = identify(frf)
    covariance = np.array([np.diag([1e-4, 1e-6]), np.diag([-1e-4, 1e-6])])
    found = replace(found, modes=replace(found.modes, covariance=covariance))
    listed = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert listed["frequency_interval_hz"][1] is None and None not in listed["damping_interval"]
    assert identification_page(found, None, ["a.txt"]).html().count("(± unknown)") == 2  # the headline and the summary
    assert "nan" in found.table().split("\n")[2]
