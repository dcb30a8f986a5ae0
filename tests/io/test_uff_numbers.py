"""Numbers of text functions: the same bits as Python's float gives, whatever the layout of the lines."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from toolpoint import ToolpointError
from toolpoint.io.uff.file import functions
from toolpoint.io.uff.numbers import regular, twenty_wide
from toolpoint.io.uff.sets import UniversalFile

NUMBERS = st.floats(allow_nan=False, allow_infinity=False, min_value=-1e99, max_value=1e99).filter(
    lambda x: x == 0 or abs(x) > 1e-98)
ANY = st.floats(allow_nan=False, allow_infinity=False)
# Form, and how many stand in a line: those of the format and of other writers.
FORMATS = st.sampled_from([("%13.5E", 6), ("%20.12E", 4), ("%20.11E", 4), ("%22.14E", 3), ("%14.6e", 1), ("%25.16E", 2)])


def bits(numbers) -> list[int]:
    return np.asarray(numbers, float).view(np.int64).tolist()


def typed(numbers, form: str, per_line: int, letter: str, end: str) -> tuple[list[str], bytes]:
    words = [(form % number).upper().replace("E", letter) for number in numbers]
    lines = ["".join(words[at:at + per_line]) for at in range(0, len(words), per_line)]
    return words, "".join(line + end for line in lines).encode()


def exact(words) -> list[float]:
    return [float(word.upper().replace("D", "E")) for word in words]


@pytest.mark.slow
@settings(deadline=None, max_examples=300)
@given(st.lists(NUMBERS, min_size=12, max_size=40), FORMATS, st.sampled_from("EDed"), st.sampled_from(["\n", "\r\n"]))
@example([1e23, 5e22, 7e22, -1e23] * 4, ("%20.12E", 4), "E", "\n")  # in the very middle between two floats
@example([0.0, -0.0, 1.0, -1.0] * 4, ("%20.12E", 4), "E", "\n")
def test_regular_lines_give_the_bits_of_float(numbers, form, letter, end):
    words, data = typed(numbers, *form, letter, end)
    found, rest = regular(data)
    whole = len(words) // form[1] * form[1]
    if form[0] == "%25.16E":  # seventeen digits are more than a product of floats can hold
        assert found.size == 0 and rest == data
    else:
        assert bits(found) == bits(exact(words[:whole]))
        assert rest.split() == [word.strip().encode() for word in words[whole:]]


@pytest.mark.parametrize("word", ["4.62021993713370E-59", "7.39235189941392E-58", "6.36659906637106E+127",
                                  "1.00000000000000E-308", "4.94065645841247E-324", "1.79769313486231E+308"])
def test_numbers_next_to_the_middle_between_floats_and_at_the_ends_of_the_range(word):
    # The first three lie within 1.3e-32 of the middle (found by continued fractions): two floats are too few for them.
    found, rest = regular(f" {word}\n".encode() * 3)
    assert bits(found) == bits([float(word)] * 3) and rest == b""


def test_many_random_numbers():
    rng = np.random.default_rng(0)
    values = rng.standard_normal(80000) * 10.0 ** rng.integers(-90, 90, 80000)
    words, data = typed(values.tolist(), "%20.12E", 4, "E", "\n")
    assert bits(regular(data)[0]) == bits(exact(words))


@pytest.mark.parametrize("change", [
    lambda d: d.replace(b"1.5", b"1,5"), lambda d: d.replace(b"1.5", b"1.x"), lambda d: d[:40] + b"\t" + d[41:],
    lambda d: d.replace(b"E+01", b"E,01"), lambda d: d.replace(b" 1.5", b"/1.5"), lambda d: d.replace(b" 1.5", b")1.5"),
    lambda d: d.replace(b" 1.5", b"01.5"), lambda d: d.replace(b"  1.5", b"- 1.5"), lambda d: d.replace(b"E+01", b"D+01"),
    lambda d: d.replace(b"1.50000E+01", b"1.5000E+101"), lambda d: d.replace(b"1.50000E+01", b"        NaN"),
    lambda d: d.replace(b"1.50000E+01", b"           ")])
def test_one_odd_line_leaves_all_to_the_other_reader(change):
    data = b"  2.50000E+00  3.50000E+00\n" * 3 + b"  1.50000E+01 -3.50000E+00\n" + b"  2.50000E+00  3.50000E+00\n" * 3
    assert regular(data)[0].size == 14
    assert change(data) != data
    found, rest = regular(change(data))
    assert found.size == 0 and rest == change(data)


def function(tmp_path, data: bytes, count: int) -> tuple[np.ndarray, list[str]]:
    """The values of a real function of double precision and even spacing with these lines of numbers."""
    lines = ["a function", "NONE", "NONE", "NONE", "NONE",
             f"{1:5d}{0:10d}{0:5d}{0:10d} {'NONE':10s}{1:10d}{1:4d} {'NONE':10s}{0:10d}{0:4d}",
             f"{4:10d}{count:10d}{1:10d}{0.0:13.5E}{1.0:13.5E}{0.0:13.5E}", *[f"{0:10d}{0:5d}{0:5d}{0:5d}"] * 4]
    path = tmp_path / "numbers.unv"
    path.write_bytes(("    -1\n    58\n" + "".join(f"{line:80s}\n" for line in lines)).encode() + data + b"    -1\n")
    file = UniversalFile(path)
    return functions.values(file, file.sets[0], functions.header(file, file.sets[0]))[1], file.repairs


@st.composite
def odd_texts(draw) -> tuple[list[str], str]:
    """Numbers as vendors write them (words as Python reads them), parted by anything that is blank."""
    words, parts = [], []
    for number in draw(st.lists(ANY, min_size=1, max_size=25)):
        word = draw(st.sampled_from(["%.5E", "%.12E", "%.16E", "%.3e", "%+.9E", "%r", "%.7f"])) % number
        word = "0.5" if len(word) > 40 else word
        words.append(word)
        letter = draw(st.sampled_from("EeDd"))
        word = word.replace("E", letter)
        if "." in word and word[-5:-4].upper() in ("E", "D") and draw(st.booleans()):
            word = word[:-5] + word[-4:]  # as Fortran does: 1.234-105
        parts.append(word + draw(st.sampled_from([" ", "   ", "\t", "\n", "\r\n", " \n", "\n\n", "\r"])))
    return words, "".join(parts)


@pytest.mark.slow
@settings(deadline=None, max_examples=300)
@given(odd_texts())
def test_any_text_gives_the_bits_of_float(tmp_path_factory, case):
    words, text = case
    found, _ = function(tmp_path_factory.mktemp("uff"), text.encode() + b"\n", len(words))
    assert bits(found) == bits([float(word) for word in words])


@settings(deadline=None, max_examples=60)
@given(st.lists(NUMBERS, min_size=1, max_size=50), FORMATS, st.sampled_from("ED"), st.sampled_from(["\n", "\r\n"]),
       st.integers(0, 49), st.sampled_from(["{}", "{:>30}", "\t{}", "{}\n", "{}   "]))
def test_whole_functions_with_a_short_last_line_and_one_odd_word(tmp_path_factory, numbers, form, letter, end, at, odd):
    words, data = typed(numbers, *form, letter, end)
    word = words[at % len(words)].encode()
    found, repairs = function(tmp_path_factory.mktemp("uff"), data.replace(word, odd.format(word.decode()).encode(), 1),
                              len(words))
    assert bits(found) == bits(exact(words))
    assert repairs == (["Fortran D exponents"] if letter == "D" else [])


def test_missing_letters_and_touching_numbers_are_reported(tmp_path):
    found, repairs = function(tmp_path, b" 1.234-105-2.5E+01 3.0+101\n 1.0E+00 2.0E+00 3.0E+00\n", 6)
    assert bits(found) == bits([1.234e-105, -25.0, 3e101, 1.0, 2.0, 3.0])
    assert repairs == ["exponents of three digits without E", "numbers that touch each other"]


def test_numbers_that_touch_in_every_line_are_reported_too(tmp_path):
    found, repairs = function(tmp_path, b"-1.5E+00-2.5E+00\n" * 3, 6)
    assert bits(found) == bits([-1.5, -2.5] * 3)
    assert repairs == ["numbers that touch each other"]


@settings(deadline=None, max_examples=300)
@given(st.lists(st.one_of(NUMBERS, st.floats()), min_size=1, max_size=40))
@example([0.0, -0.0, 0.5, 1.0, 9.9999999999994999, 9.9999999999995, 9.99999999999951, 1e22, 1e23, 1e-5, 9.5e-98, 1e98, 1e99])
@example([1.0000000000005, 1.00000000000050004, 1000000000000.5, 1000000000001.5, 2**43 + 0.5, 1e-98, 1e100, -1e100, 5e-324])
def test_written_numbers_are_those_of_the_format(numbers):
    expected = [f"{number:20.12E}" for number in numbers]
    assert twenty_wide(np.array(numbers)).tobytes().decode() == "".join(expected)


def test_many_random_numbers_are_written_as_the_format_says():
    rng = np.random.default_rng(0)
    values = rng.standard_normal(80000) * 10.0 ** rng.integers(-90, 90, 80000)
    near = (rng.integers(10**12, 10**13, 20000) + 0.5) * 10.0 ** rng.integers(-40, 20, 20000)  # hard to round
    numbers = np.concatenate([values, near, 10.0 ** np.arange(-110, 111)])
    assert twenty_wide(numbers).tobytes().decode() == "".join(f"{number:20.12E}" for number in numbers.tolist())


@pytest.mark.parametrize("word", ["nan", "NaN", "inf", "-Inf", "INF"])
def test_words_for_what_is_no_number_are_kept_to_be_refused_later(tmp_path, word):
    found, _ = function(tmp_path, f" 1.0E+00 {word}\n 1.0E+00 2.0E+00\n".encode(), 4)
    assert bits(found) == bits([1.0, float(word), 1.0, 2.0])


@pytest.mark.parametrize("word", ["*************", "1.0E+0x", "1.2.3", "--1.0"])
def test_what_is_no_number_is_refused_with_file_and_function(tmp_path, word):
    with pytest.raises(ToolpointError, match=r"numbers\.unv: function 'a function' of 1:\+x: .*damaged"):
        function(tmp_path, f" 1.0E+00 {word}\n 1.0E+00 2.0E+00\n".encode(), 4)


@pytest.mark.parametrize("data", [b"", b"\n", b"  \r\n  "])
def test_a_function_without_numbers_is_cut_short(tmp_path, data):
    with pytest.raises(ToolpointError, match="holds 0 of 1 values; it is cut short"):
        function(tmp_path, data, 1)


@pytest.mark.parametrize("cut", [1, 2, 3, 4, 5, 8])
def test_a_number_that_the_end_of_the_file_cuts_is_not_read(tmp_path, cut):
    whole, _ = function(tmp_path, b"  1.00000E+00  2.00000E+00\n  3.00000E+00  1.23456E-08\n", 4)
    path = tmp_path / "numbers.unv"
    data = path.read_bytes()
    end = data.rindex(b"\n    -1")
    path.write_bytes(data[:end])  # the closing line alone is lost
    file = UniversalFile(path)
    head = functions.header(file, file.sets[0])
    assert bits(functions.values(file, file.sets[0], head)[1]) == bits(whole)
    path.write_bytes(data[:end - cut])
    file = UniversalFile(path)
    with pytest.raises(ToolpointError, match="holds 3 of 4 values; it is cut short"):
        functions.values(file, file.sets[0], head)


@pytest.mark.parametrize("end", [b"\n", b"\r\n", b"\r"])
def test_numbers_of_the_next_set_are_not_those_of_a_function_that_is_cut_short(tmp_path, end):
    lines = b"".join(b"%20.12E" % 1.5 * 4 + b"\n" for _ in range(4))
    point = b"         1         0         0         0\n" + b"       1.0000E+00       1.0000E+00       1.0000E+00\n"
    # The set of points is closed where the function would be, were it whole.
    data = lines + b"    -1\n    -1\n  2411\n" + 3 * point
    with pytest.raises(ToolpointError, match="holds 16 of 32 values; it is cut short"):
        function(tmp_path, data.replace(b"\n", end), 32)
