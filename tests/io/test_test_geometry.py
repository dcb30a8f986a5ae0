"""Places of a test's points: of the file that is named, else of the measured file that holds them, else an error."""

import pytest

from toolpoint import ToolpointError, io
from toolpoint.io import uff
from toolpoint.io.uff.geometry import MeasuredGeometry


def test_places_of_the_measured_file_are_taken_where_none_is_named(tmp_path):
    places = MeasuredGeometry(("1", "2"), [[0.0, 0.0, 0.0], [1.0, 0.5, 0.0]], ())
    uff.write(tmp_path / "test.uff", places)
    (tmp_path / "own.csv").write_text("point,x,y,z\n7,0,0,1\n")
    (tmp_path / "bare.uff").write_text("")
    read = io.read_test_geometry(None, [tmp_path / "bare.uff", tmp_path / "test.uff"])
    assert {str(name) for name in read.points} == {"1", "2"}
    assert {str(name) for name in io.read_test_geometry(tmp_path / "own.csv", [tmp_path / "test.uff"]).points} == {"7"}
    with pytest.raises(ToolpointError, match=r"geometry.*bare\.uff holds no places of points; name a file"):
        io.read_test_geometry(None, [tmp_path / "bare.uff"])
