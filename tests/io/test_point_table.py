"""Tables of points: their unit is what the line of names states; what cannot be a place is refused by its line."""

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint.io.measured import geometry_files
from toolpoint.io.point_table import read

PLACES = {1: [0.0, 0.1, -0.25], "tip": [1.2, 0.0, 0.4]}


@pytest.mark.parametrize("text", [
    "1,0,0.1,-0.25\ntip,1.2,0,0.4\n", "point,x,y,z\n1,0,0.1,-0.25\ntip,1.2,0,0.4\n", "# a\n\n1,0,0.1,-0.25\ntip,1.2,0,0.4",
    "point,x [mm],y [mm],z [mm]\n1,0,100,-250\ntip,1200,0,400\n", "Point;X (mm);Y (cm);Z (m)\n1;0;10;-0,25\ntip;1200;0;0,4\n",
    '"1"\t"0"\t"0,1"\t"-,25"\n"tip"\t"1,2"\t"0"\t"0,4"\n'])
def test_units_separators_and_commas(tmp_path, text):
    for encoding in ("utf-8-sig", "utf-16"):
        (tmp_path / "points.csv").write_text(text, encoding=encoding)
        points = geometry_files.read(tmp_path / "points.csv").points
        assert list(points) == list(PLACES)
        np.testing.assert_allclose(list(points.values()), list(PLACES.values()), rtol=1e-12)


def test_the_unit_of_a_body_holds_where_the_table_states_none(tmp_path):
    (tmp_path / "points.csv").write_text("7,1500,0,0\n")
    np.testing.assert_allclose(read(tmp_path / "points.csv", length=1e-3)[7], [1.5, 0, 0])
    (tmp_path / "points.csv").write_text("node,x [m],y [m],z [m]\n7,1.5,0,0\n")
    np.testing.assert_allclose(read(tmp_path / "points.csv", length=1e-3)[7], [1.5, 0, 0])


@pytest.mark.parametrize(("text", "words"), [
    ("1,0,0,0\n1,1,0,0\n", r"csv:2: point 1 is there twice"), ("1,0,nan,0\n", r"csv:1: .* finite"),
    ("1,0,0,0\n2,1200,0,350\n", r"point 2 lies 1200 m away.*x \[mm\]"), ("point,x [mm],y,z\n1,0,0,0\n", "x, y and z"),
    ("point,x [kg],y [kg],z [kg]\n1,0,0,0\n", "not one of length"), ("1,0,0\n", r"csv:1: .*point,x,y,z in m"),
    ("a,b\n", "no points")])
def test_what_is_no_place_is_refused(tmp_path, text, words):
    (tmp_path / "points.csv").write_text(text)
    with pytest.raises(ToolpointError, match=words):
        geometry_files.read(tmp_path / "points.csv")
