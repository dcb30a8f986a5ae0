"""The rule of digits: a value is shown to the last digit of its uncertainty, and both can be read back."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from toolpoint._rounding import limit_text, number_text, plain_numbers, text_below, uncertainty_text, with_uncertainty


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


@pytest.mark.parametrize(("sentence", "words"), [
    ("1.4e+04 times better", "14000 times better"), ("of 1.37e+03 N", "of 1370 N"), ("1e+02 or 1.1", "100 or 1.1"),
    ("-1.2e-03 m", "-0.0012 m"), ("4e+08 N/m", "4e+08 N/m"), ("run_1.5e+04.csv", "run_1.5e+04.csv"), ("2.5e-07", "2.5e-07")])
def test_a_sentence_has_digits_where_the_power_of_ten_is_small(sentence, words):
    assert plain_numbers(sentence) == words


@pytest.mark.parametrize(("value", "error", "text"), [
    (9.1995, 0.0017, "9.19"), (10.074, 0.0, "10.0"), (8.496, 0.0078, "8.48"), (2.0, 0.3, "2.0 ± 0.3")])
def test_a_limit_is_rounded_down_with_its_error_taken_off_or_printed(value, error, text):
    assert limit_text(value, error) == text
