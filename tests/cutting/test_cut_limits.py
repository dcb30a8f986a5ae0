"""What a cut's numbers may be is refused before anything is read or computed, in the unit in which it was given."""

import math

import pytest

from toolpoint import ToolpointError
from toolpoint.cutting.description import PARAMETERS, SI_VALUE, WORDS, check_cut, check_values

LIMITED = [(key, kind, limit) for key, parameter in PARAMETERS.items() for kind, limit in parameter.limits.items()]


@pytest.mark.parametrize(("key", "kind", "limit"), LIMITED)
def test_a_number_beyond_a_limit_is_refused_under_the_name_it_was_given(key, kind, limit):
    step = 1 if PARAMETERS[key].kind == "count" else max(abs(limit), 1.0) * 1e-6
    beyond = limit + (step if kind in ("lt", "le") else -step)
    shown = f"{WORDS[kind][0]} {limit / SI_VALUE[PARAMETERS[key].unit]:g}"
    with pytest.raises(ToolpointError, match=rf"--cut: .*must be .*{shown}"):
        check_values({key: beyond}, {key: "--cut"})
    within = {"gt": limit + step, "ge": limit, "lt": limit - step, "le": limit}[kind]
    check_values({key: within})


@pytest.mark.parametrize("value", [math.nan, math.inf, (0.1, math.nan)])
def test_what_is_no_number_is_refused_also_without_limits(value):
    with pytest.raises(ToolpointError, match=r"`helix`: (nan|inf) degrees; must be"):
        check_values({"helix": value})


@pytest.mark.parametrize(("speed", "depth", "feed", "name"), [
    (0, 1e-3, None, "speed"), (math.nan, 1e-3, None, "speed"), (900, -2e-3, None, "depth"), (900, 2.0, None, "depth"),
    (900, 1e-3, 0.0, "feed")])
def test_a_simulated_cut_needs_speed_depth_and_feed(speed, depth, feed, name):
    with pytest.raises(ToolpointError, match=f"`{name}`: "):
        check_cut({"feed_per_tooth": feed}, speed, depth)
    check_cut({"feed_per_tooth": None}, 900, 1e-3)
