"""What was stated of the views is questioned where the machine does not explain the videos, and nothing else is."""

from types import SimpleNamespace

import pytest

from toolpoint import ToolpointError
from toolpoint.studies.video.stated_views import question_views
from toolpoint.vision.view import View

TRUE = (View.of_plane("xz", 2.5e-3), View.of_plane("yz", 2.5e-3))


def explained(views, floor=1.0, growth=900.0):
    """An update whose misfit grows with the square of the scale's error, and is large where a plane is wrong."""
    wrong = sum(view.right != true.right for view, true in zip(views, TRUE, strict=True))
    off = views[0].metres / TRUE[0].metres - 1
    misfit = floor + growth * off**2 + 200.0 * wrong
    return SimpleNamespace(update=SimpleNamespace(fit=SimpleNamespace(reduced_chi_square=misfit)),
                           videos=[SimpleNamespace(view=view) for view in views])


@pytest.mark.parametrize("factor", [0.9, 1.08, 1.15])
def test_a_scale_that_is_off_is_named_with_the_right_one(factor):
    stated = [View(view.right, view.down, factor * view.metres, view.origin) for view in TRUE]
    (doubt,) = question_views(explained(stated), explained)
    assert str(doubt).startswith("scale") and doubt.figure == pytest.approx(2.5, rel=0.01)


def test_exchanged_views_are_named():
    (doubt,) = question_views(explained(TRUE[::-1]), explained)
    assert str(doubt).startswith("views: exchanged") and "+x to the right, as was stated of the second" in str(doubt)


@pytest.mark.parametrize("floor", [1.0, 40.0])
def test_right_statements_are_not_questioned(floor):
    """Neither where all is explained, nor where what is wrong lies elsewhere and no other statement explains more."""
    assert question_views(explained(TRUE, floor), lambda views: explained(views, floor)) == ()


def test_views_by_which_nothing_can_be_updated_explain_nothing():
    def refuse(views):
        raise ToolpointError("videos: no interface moves")
    assert question_views(explained(TRUE[::-1]), refuse) == ()
