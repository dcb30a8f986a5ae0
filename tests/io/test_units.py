"""Units: what a wrong one is answered with."""

import pytest

from toolpoint.io.quantities import units


@pytest.mark.parametrize(("wrong", "meant"), [
    ("kgs", "'kg'"), ("KG", "'kg'"), ("kilograms", "'kg'"), ("meters", "'m'"), ("millimetres", "'mm'"), ("mms", "'mm'"),
    ("degrees", "'deg'"), ("radians", "'rad'"), ("Newton", "'N'"), ("secs", "'s'"), ("mpa", "'MPa'"), ("rev/min", "'rpm'"),
    ("microns", "'um'"), ("in", "1 in is 25.4 mm"), ("lbf", "1 lbf is 4.4482 N")])
def test_a_wrong_unit_is_answered_with_the_one_that_was_meant(wrong, meant):
    assert meant in units.nearest(wrong)
    with pytest.raises(units.UnitError, match="unknown unit"):
        units.quantity(f"3 {wrong}", units.MASS)


def test_imperial_sizes_are_those_of_the_definitions():
    """1 in = 25.4 mm, 1 lb = 0.45359237 kg, standard gravity 9.80665 m/s^2 (ISO 80000)."""
    assert "0.45359 kg" in units.nearest("lb")
    assert f"{0.45359237 * 9.80665:.5g} N" in units.nearest("lbf")
    assert f"{0.45359237 * 9.80665 / 0.0254**2:.5g} Pa" in units.nearest("psi")


@pytest.mark.parametrize("text", ["30 Grad", "30 grad", "180 degrees"])
def test_a_degree_of_another_language_is_no_billion_of_radians(text):
    with pytest.raises(units.UnitError, match="did you mean 'deg'"):
        units.quantity(text, units.ANGLE)
