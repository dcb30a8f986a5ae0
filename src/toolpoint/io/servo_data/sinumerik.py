"""Sinumerik servo-tuning XML: time series and the controller's own spectra of a frequency response measurement; read."""

from __future__ import annotations

import struct
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from toolpoint._check import ComplexArray, FloatArray, ToolpointError
from toolpoint._notebook import NotebookText
from toolpoint.drives.simulation.loop_identification import LoopResponse
from toolpoint.io.door import door
from toolpoint.io.faults import Fault, FileFaults
from toolpoint.vibration import Dof, Record

_ALPHABET = "0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ!#$`()*+-/:;=?@[]^_{|}~"
_VALUE = {letter: value for value, letter in enumerate(_ALPHABET)}
_BLOCK = {"double": 1, "ComplexNumber": 2}


@dataclass(frozen=True, eq=False)
class FrequencyTrace(NotebookText):
    """A measured frequency response as the controller stored it.

    Parameters
    ----------
    output, input : sequences of Record
        Series of the output and the input signal, one for each run (direction of the offset), SI as stored.
    frequency : (n_f,) floats
        Hz.
    output_spectrum, input_spectrum : (n_f,) floats
        The controller's averaged auto-spectra.
    cross_spectrum : (n_f,) complexes
        The controller's averaged cross-spectrum of output and input.
    settings : dict
        Named numbers of the excitation (words of the file).
    """

    output: tuple[Record, ...]
    input: tuple[Record, ...]
    frequency: FloatArray
    output_spectrum: FloatArray
    input_spectrum: FloatArray
    cross_spectrum: ComplexArray
    settings: dict[str, float]

    @property
    def response(self) -> ComplexArray:
        """The controller's own frequency response, (n_f,): the file keeps conj(Y) U, so its conjugate over |U|^2."""
        return np.asarray(np.conj(self.cross_spectrum) / self.input_spectrum, complex)

    @property
    def line_frequency(self) -> FloatArray:
        """Frequency of each line of the discrete transform, k f_s / N, Hz.

        The file's own axis divides by N - 1 and reads 0.15 % high; line k of both is the same line.
        """
        record = self.input[0]
        return np.arange(self.frequency.size) * record.sample_rate / record.samples.shape[0]

    @property
    def loop(self) -> LoopResponse:
        """The measurement as a loop, where its input is the set point of a closed loop and its output the actual value: T
        as measured and L = T/(1 - T), without the line at zero."""
        closed = self.response[1:]
        return LoopResponse(self.line_frequency[1:], closed, closed / (1 - closed), self.coherence[1:],
                            1 / self.input[0].sample_rate)

    @property
    def coherence(self) -> FloatArray:
        """|cross|^2 / (input spectrum x output spectrum), (n_f,)."""
        return np.abs(self.cross_spectrum) ** 2 / np.maximum(self.input_spectrum * self.output_spectrum, 1e-300)

    def __repr__(self) -> str:
        return (f"FrequencyTrace({len(self.input)} runs of {self.input[0].samples.shape[0]} samples at "
                f"{self.input[0].sample_rate:g} Hz; {self.frequency[0]:g}..{self.frequency[-1]:g} Hz)")


@door("controller trace")
def read(path: str | Path) -> FrequencyTrace:
    """Return the measurement of a file of the kind ResponseTestCustom.

    Raises
    ------
    FileFaults
        Broken XML, another kind of file, arrays that do not decode or have another length than the file says.
    """
    path = Path(path)
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise ToolpointError(f"{path}: cannot be read ({error.strerror}); check the name and the folder") from None
    text = raw.decode("latin-1")
    try:
        root = ET.fromstring(raw)
    except ET.ParseError as error:
        line, column = error.position
        raise FileFaults(str(path), text, [Fault(line, column + 1, "", f"broken XML: {error.msg}")]) from None
    except (LookupError, ValueError) as error:
        raise FileFaults(str(path), text, [Fault(1, 1, "", f"broken XML: {error}; a trace is in UTF-8")]) from None
    return _Reader(path, text, root).trace()


class _Reader:
    def __init__(self, path: Path, text: str, root: ET.Element) -> None:
        self.path, self.text, self.root = path, text, root

    def fail(self, message: str, key: str = "") -> FileFaults:
        position = self.text.find(key) if key else -1
        line = self.text.count("\n", 0, position) + 1 if position >= 0 else 1
        return FileFaults(str(self.path), self.text, [Fault(line, 1, key, message)])

    def trace(self) -> FrequencyTrace:
        nodes = {self.number(n, "m_iUniqueInstanceId"): n for n in self.root.iter("PlatformSignalNode")}
        primary = next(self.root.iter("PrimaryFreqRespSigNodeData"), None)
        if primary is None or len(nodes) < 2:
            raise self.fail("no frequency response with two signals; expected a servo-tuning measurement", "")
        ends = [self.number(primary, f"m_i{word}SigNodeUniqueInstanceID") for word in ("Output", "Input")]
        if not all(end in nodes for end in ends):
            raise self.fail("input or output signal is missing", "m_listPrimaryFreqRespSigNodeData")
        out, into = nodes[ends[0]], nodes[ends[1]]
        f, yy = self.spectrum(out, "m_autospectrumInfo")
        _, uu = self.spectrum(into, "m_autospectrumInfo")
        _, yu = self.spectrum(out, "m_crossSpecInfoList_el")
        excitation = next(self.root.iter("ExcitationSource"), None)
        settings = {} if excitation is None else {
            str(e.get("name")): float(e.text or "nan") for e in excitation.iter() if e.tag in ("float", "unsigned_int")}
        return FrequencyTrace(self.series(out, "output"), self.series(into, "input"), f, yy.real, uu.real, yu, settings)

    def number(self, element: ET.Element, name: str) -> float:
        for child in element:
            if child.get("name") == name and child.text:
                try:
                    return float(child.text)
                except ValueError:
                    raise self.fail(f"{name} is {child.text.strip()[:40]!r}; must be a number", name) from None
        raise self.fail(f"{name} is missing", name)

    def series(self, node: ET.Element, name: str) -> tuple[Record, ...]:
        records = []
        for k, part in enumerate(node.iter("TimeSeries")):
            values = self.array(next(part.iter("NumericArray")))
            count, end = self.number(part, "m_TimeVector.length"), self.number(part, "m_TimeVector.end")
            if values.size != count or end <= 0:
                raise self.fail(f"{values.size} samples for a time vector of {count:g}", "m_TimeVector.length")
            records.append(Record(values.real[:, None], (count - 1) / end, (Dof(name, "+rz"),), (name,),
                                  name=f"{name}, run {k + 1}"))
        if not records:
            raise self.fail("a signal without time series", "m_TimeSeriesList")
        return tuple(records)

    def spectrum(self, node: ET.Element, name: str) -> tuple[FloatArray, ComplexArray]:
        for part in node.iter("SigNodeCrossSpectrumInfo"):
            if part.get("name") == name:
                arrays = {a.get("name"): self.array(a) for a in part.iter("NumericArray")}
                if {"m_ValueVector", "m_FrequencyVector"} <= arrays.keys():
                    return arrays["m_FrequencyVector"].real, arrays["m_ValueVector"]
        raise self.fail("spectrum is missing", name)

    def array(self, element: ET.Element) -> ComplexArray:
        raw = element.find("raw")
        packed = "".join((raw.text or "").split()) if raw is not None else ""
        length, width = int(self.number(element, "m_length")), _BLOCK.get(str(element.get("elementtype")), 0)
        if element.get("format") != "base85" or width == 0:
            raise self.fail(f"array of {element.get('elementtype')} in {element.get('format')}; known: base85 doubles",
                            str(element.get("name")))
        try:
            values = _decoded(packed)
        except (KeyError, ValueError, struct.error) as error:
            raise self.fail(f"array that does not decode: {error}", packed[:40]) from None
        if values.size != width * length:
            raise self.fail(f"{values.size} numbers decoded, {width * length} expected", packed[:40])
        return values.astype(complex) if width == 1 else values[::2] + 1j * values[1::2]


def _decoded(packed: str) -> FloatArray:
    """Return doubles: big-endian 4-byte words, each five base-85 digits; one point stands for a word of zeros."""
    words, position = bytearray(), 0
    while position < len(packed):
        if packed[position] == ".":
            words += b"\0\0\0\0"
            position += 1
            continue
        group = packed[position:position + 5]
        if len(group) < 5:
            raise ValueError("the last group is cut short")
        value = 0
        for letter in group:
            value = 85 * value + _VALUE[letter]
        words += struct.pack(">I", value)
        position += 5
    return np.frombuffer(bytes(words), ">f8").astype(float)
