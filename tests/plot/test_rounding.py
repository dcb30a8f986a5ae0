"""The rule of digits: a value is shown to the last digit of its uncertainty, and both can be read back."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from toolpoint._rounding import number_text, text_below, uncertainty_text, with_uncertainty


@pytest.mark.parametrize(("value", "half", "text"), [
    (922.423, 6.0, "922 ± 6 Hz"), (922.423, 0.6, "922.4 ± 0.6 Hz"), (922.423, 0.12, "922.42 ± 0.12 Hz"),
    (922.423, 0.098, "922.42 ± 0.10 Hz"), (922.4, 60.0, "920 ± 60 Hz"), (1.5e9, 2e7, "(1.500 ± 0.020)×10⁹ Hz"),
    (-0.001, 0.2, "0.00 ± 0.20 Hz"), (5.0, math.inf, "5.000 Hz (± unknown)"), (5.0, None, "5.000 Hz")])
def test_digits_follow_the_uncertainty(value, half, text):
    assert with_uncertainty(value, half, "Hz") == text


@given(st.floats(-1e5, 1e5), st.floats(1e-4, 1e4))
def test_rounding_loses_less_than_the_uncertainty(value, half):
    assert abs(float(number_text(value, half)) - value) <= 0.5 * half
    assert abs(float(uncertainty_text(half)) / half - 1) < 0.17
    assert len(number_text(value, half).partition(".")[2]) == len(uncertainty_text(half).partition(".")[2])


def test_numbers_without_one_have_four_digits():
    assert [number_text(v) for v in (0.0, 2.5, 12345.6, 1e7, math.nan, math.inf)] == [
        "0", "2.500", "12346", "1e+07", "none", "unlimited"]


@given(st.floats(1e-3, 1e5), st.integers(2, 5))
def test_a_limit_is_never_rounded_up(value, digits):
    shown = float(text_below(value, digits))
    assert shown <= value * (1 + 1e-9) and value - shown <= 1.01 * 10.0 ** (math.floor(math.log10(value)) - digits + 1)
