"""Time histories in text: units of the columns."""

from __future__ import annotations

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint.io.text import record_table


@pytest.mark.parametrize(("column", "factor"), [
    ("acceleration", 1.0), ("acceleration [g]", 9.80665), ("acceleration [mm/s^2]", 1e-3), ("velocity [mm/s]", 1e-3),
    ("displacement [um]", 1e-6), ("Fx [kN]", 1e3)])
def test_columns_become_si(tmp_path, column, factor):
    (tmp_path / "r.csv").write_text(f"time [ms],{column}\n0,1\n1,2\n2,3\n")
    record = record_table.read(tmp_path / "r.csv")
    assert record.sample_rate == pytest.approx(1000)
    assert record.samples[:, 0] == pytest.approx([factor, 2 * factor, 3 * factor])


def test_a_unit_of_another_kind_is_refused(tmp_path):
    (tmp_path / "r.csv").write_text("time,acceleration [mm]\n0,1\n1,2\n")
    with pytest.raises(ToolpointError, match="acceleration"):
        record_table.read(tmp_path / "r.csv")


def test_a_column_of_any_name_is_read_in_its_unit(tmp_path):
    path = tmp_path / "positions.csv"
    path.write_text("time [ms],Pos (mm),Angle [deg],Current [A]\n0,1,180,2\n1,2,90,3\n2,3,0,4\n")
    record = record_table.read(path)
    np.testing.assert_allclose(record.samples, [[1e-3, np.pi, 2], [2e-3, np.pi / 2, 3], [3e-3, 0, 4]], rtol=1e-12)
