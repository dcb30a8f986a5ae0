"""`toolpoint sensitivity`: the table, the page, and laws of the numbers in it."""

import json
from pathlib import Path

import numpy as np
import pytest

from toolpoint.app.main import main

MACHINE = Path(__file__).resolve().parents[2] / "src/toolpoint/app/machines/three_axis_vertical.yaml"


def test_table_and_page(tmp_path, capsys):
    main(["sensitivity", str(MACHINE), "-o", str(tmp_path / "page")])
    assert "cumulative per part" in capsys.readouterr().out
    page = (tmp_path / "page/index.html").read_text()
    for words in ("Frequencies, parameter by parameter", "Frequencies, part by part", "1 - MAC", "All numbers"):
        assert words in page


def test_all_stiffnesses_together_give_one_half(capsys, tmp_path):
    """Euler: frequencies are homogeneous of degree 1/2 in the stiffnesses."""
    main(["sensitivity", str(MACHINE), "--count", "4", "-o", str(tmp_path / "page"), "--json"])
    found = json.loads(capsys.readouterr().out)["relative_sensitivity"]
    total = np.sum([row for path, row in found.items() if ".stiffness." in path], axis=0)
    np.testing.assert_allclose(total, 0.5, atol=1e-9)


@pytest.mark.parametrize("path", ["joints.foundaton.stiffness.rx", "bodies.column.colour"])
def test_wrong_path(path, capsys):
    with pytest.raises(SystemExit) as stopped:
        main(["sensitivity", str(MACHINE), "--parameter", path])
    assert stopped.value.code == 2
    assert "Traceback" not in capsys.readouterr().err
