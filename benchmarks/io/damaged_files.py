"""Damaged files: valid ones of our own writers, mutated; every reader must answer with a result or a ToolpointError, in time.

    python benchmarks/io/damaged_files.py --inputs 20000 [--only lvm,wav,tdms]

Every input is one valid file with some bytes changed, cut, doubled, swapped with those of another file or replaced by nasty
words, given to a reader. Counted are foreign exceptions, readings over 5 s of CPU time (by the clock a busy machine makes any
number), and the growth of this process (bound: 1 GB).
"""

from __future__ import annotations

import random
import resource
import sys
import tempfile
import time
import warnings
from collections import Counter
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import h5py
import numpy as np
from nptdms import ChannelObject, TdmsWriter
from scipy.io import savemat, wavfile

from benchmarks.frame import MEASURED_DATA, CommandLine
from toolpoint._check import ToolpointError
from toolpoint.io import uff
from toolpoint.io.binary import hdf5, numpy_arrays
from toolpoint.io.matrices import matrix_files
from toolpoint.io.measured import frf_files, geometry_files, mode_files, record_files
from toolpoint.io.meshes import mesh_files, stl
from toolpoint.io.program import command_stream, gcode
from toolpoint.io.servo_data import controller_records, sinumerik
from toolpoint.io.text import frf_table, record_table
from toolpoint.io.yaml import component_file, drive_file, machine_file, plan_file, robot_file, shaft_file
from toolpoint.io.yaml.testing import test_file
from toolpoint.vibration import Frf, Modes, Record

SECONDS, GROWTH = 5.0, 1e9
PACKAGE = Path(machine_file.__file__).parents[2]
MACHINES = PACKAGE / "app" / "machines"
# Real files beside the project, where they are; larger ones would only be slower.
LARGEST = 150_000
WORDS = [b"-1", b"9" * 400, b"1e999", b"nan", b"*a", b"&a", b"[" * 300, b"\0" * 8, b"\xff" * 8, b"<a>", b"\n", b"-1\n    -1\n",
         b"2147483647", b"18446744073709551615", b"{", b": ", b"UTF-4", b",,,", b"D+400", b"\x7f\xff\xff\xff"]
Reader = Callable[[Path], object]
PROGRAMS = {
    "loop.nc": "%\nO1\nG21 G90 G54 G17\n#1=0\nWHILE [#1 LT 3] DO1\nG1 X[#1*10] Y0 F500\n#1=[#1+1]\nEND1\nG81 R2 Z-5 X1 Y1\nX2\n"
               "G80\nM98 P2 L2\nM30\nO2\nG2 X5 Y5 R5\nM99\n%\n",
    "part.mpf": "N10 G90 G71 G54\nDEF REAL A=3\nR1=2\nFOR R1=1 TO 3\nG1 X=A*R1 Y=IC(2) F300\nENDFOR\nIF R1>2 GOTOF ENDE\n"
                "G3 X10 Y0 CR=5\nENDE: M30\n",
    "holes.mpf": "G17 G90 F120 S500\nTRANS X10\nAROT RPL=30\nMCALL CYCLE83(30,0,2,-40,,-10,,2,0,0,1,1)\n"
                 "HOLES1(5,10,30,20,15,3)\nMCALL\nMIRROR X0\n"
                 "CYCLE86(30,2,3,-15,,0,3,-1,-1,1,0)\nG3 X10 Y0 CR=5\nG68 X1 Y2 R30\nG0 X1\nM30\n",
    "part.h": "BEGIN PGM A MM\nTOOL CALL 1 Z S2000\nL X+0 Y+0 Z+5 R0 FMAX\nL Z-2 F200\nCC X+10 Y+0\nC X+20 Y+0 DR-\n"
              "CYCL DEF 7.0 DATUM SHIFT\nCYCL DEF 7.1 X+5\nEND PGM A MM\n"}
MESH = "BEGIN BULK\nGRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\nGRID,3,,0.,1.,0.\nGRID,4,,0.,0.,1.\nCTETRA,1,1,1,2,3,4\nENDDATA\n"
MEASURED: dict[str, Reader] = {
    "controller/*": lambda path: controller_records.read(path), "gcode/*": lambda path: gcode.read(path),
    "matrices/*": lambda path: matrix_files.read_labelled(path), "sinumerik/*": lambda path: controller_records.read(path)}


def sources(folder: Path) -> list[tuple[Path, list[Reader]]]:
    """Write one valid file of every format and return each with the readers that it is for."""
    rng = np.random.default_rng(1)
    labels = ("1:+x", "2:+z")
    frf = Frf(np.arange(1.0, 13.0), rng.normal(size=(12, 2, 1)) + 1j * rng.normal(size=(12, 2, 1)), labels, labels[:1],
              coherence=np.full((12, 2, 1), 0.9))
    alone = frf.selected([0], [0])
    modes = Modes(np.array([10.0, 20.0]), np.array([0.01, 0.02]), rng.normal(size=(2, 2)), labels, "unscaled")
    record = Record(rng.normal(size=(20, 2)), 1000.0, labels, ("force", "acceleration"))
    forces = Record(rng.normal(size=(20, 1)), 1000.0, ("tool:+x",), ("force",))
    files: list[tuple[Path, list[Reader]]] = []

    def put(name: str, write: Callable[[Path], object], *readers: Reader) -> None:
        write(folder / name)
        files.append((folder / name, list(readers)))

    universal: list[Reader] = [uff.read_frf, uff.read_modes, uff.read_record, uff.read_geometry, uff.headers]
    put("frf.unv", lambda path: uff.write(path, frf), *universal)
    put("frf_text.unv", lambda path: uff.write(path, frf, text=True), *universal)
    put("modes.unv", lambda path: uff.write(path, modes), *universal)
    put("record.unv", lambda path: uff.write(path, record), *universal)
    put("frf.txt", lambda path: frf_table.write(alone, path), frf_table.read, frf_files.read)
    put("record.csv", lambda path: record_table.write(forces, path), record_files.read, geometry_files.read)
    put("points.csv", lambda path: path.write_text("1,0,0,0\n2,0.5,0,1\n"), geometry_files.read)
    put("frf.npz", lambda path: numpy_arrays.write_frf(frf, path), frf_files.read)
    put("table.npy", lambda path: np.save(path, rng.normal(size=(9, 3))), numpy_arrays.read_table)
    put("nouns.h5", lambda path: hdf5.write({"a": frf, "b": modes, "c": record}, path), hdf5.read_all, mode_files.read)
    table = {"f": frf.frequency, "h": frf.values[:, 0, 0], "s": {"a": np.arange(4.0)}, "outputs": ["1:+x"], "inputs": ["1:+x"]}
    put("frf.mat", lambda path: savemat(path, table), frf_files.read, record_files.read)
    put("packed.mat", lambda path: savemat(path, table, do_compression=True), frf_files.read)
    put("new.mat", lambda path: _write_73(path, frf), frf_files.read)
    put("cube.stl", lambda path: path.write_bytes(bytes(80) + (2).to_bytes(4, "little") + rng.bytes(100)), stl.read)
    put("trace.xml", lambda path: path.write_text(TRACE), sinumerik.read)
    put("part.nc", lambda path: path.write_text("G21 G90\nG0 X0 Y0\nG1 X10 Y5 F1000\nG2 X20 Y0 I5 J0\nM30\n"), gcode.read)
    put("stream.csv", lambda path: path.write_text("time,X,Y\n0,0,0\n0.001,0.1,0\n0.002,0.2,0\n"), command_stream.read)
    readers = [machine_file.read, drive_file.read, component_file.read, robot_file.read, plan_file.read, shaft_file.read,
               test_file.read]
    for source in sorted([*MACHINES.parent.rglob("*.yaml"), *(PACKAGE / "io" / "templates").rglob("*.yaml")]):
        put(source.name, lambda path, source=source: path.write_bytes(source.read_bytes()), *readers)
    tone = (1e4 * rng.normal(size=(50, 2))).astype(np.int16)
    put("tone.wav", lambda path: wavfile.write(path, 1000, tone), record_files.read)
    for number, sections in enumerate((1, 2)):
        put(f"blows{number}.lvm", lambda path, n=sections: path.write_text(_lvm_text(n, rng)), record_files.read)
    put("blows.tdms", lambda path: _write_tdms(path, tone), record_files.read)
    for name, text in PROGRAMS.items():
        put(name, lambda path, text=text: path.write_text(text), gcode.read)
    put("plane.bdf", lambda path: path.write_text(MESH), mesh_files.read_nodes, matrix_files.read_labelled)
    for pattern, reader in MEASURED.items():
        for source in sorted(MEASURED_DATA.glob(pattern)):
            if source.stat().st_size < LARGEST:
                put("real_" + source.name, lambda path, source=source: path.write_bytes(source.read_bytes()), reader)
    return files


def _lvm_text(sections: int, rng: np.random.Generator) -> str:
    head = "LabVIEW Measurement\t\nWriter_Version\t2\nSeparator\tTab\nDecimal_Separator\t.\n***End_of_Header***\t\n\t\n"
    section = ("Channels\t2\t\nSamples\t6\t6\t\nY_Unit_Label\tN\tm/s^2\t\nDelta_X\t0.001\t0.001\t\n***End_of_Header***\t\n"
               "X_Value\tHammer\tTip\tComment\n")
    rows = ["".join(f"{k * 0.001:.3f}\t{force:.5f}\t{acceleration:.5f}\n" for k, (force, acceleration) in
                    enumerate(rng.normal(size=(6, 2)))) for _ in range(sections)]
    return head + "\n".join(section + values for values in rows)


def _write_tdms(path: Path, samples: np.ndarray) -> None:
    with TdmsWriter(path) as file:
        file.write_segment([ChannelObject("blow", name, samples[:, i] * 1.0, {"wf_increment": 0.001, "unit_string": unit})
                            for i, (name, unit) in enumerate((("hammer", "N"), ("tip", "m/s^2")))])


def _write_73(path: Path, frf: Frf) -> None:
    with h5py.File(path, "w", userblock_size=512) as file:
        file["f"] = frf.frequency[None, :]
        values = np.zeros((1, frf.frequency.size), np.dtype([("real", float), ("imag", float)]))
        values["real"], values["imag"] = frf.values[:, 0, 0].real, frf.values[:, 0, 0].imag
        file["h"] = values


def mutated(data: bytes, other: bytes, chance: random.Random) -> bytes:
    """Return data with one to eight changes."""
    out = bytearray(data)
    for _ in range(chance.choice([1, 1, 2, 4, 8])):
        at, end = sorted(chance.randrange(len(out) + 1) for _ in range(2))
        end = min(end, at + chance.choice([1, 2, 4, 8, 80, 1000]))
        kind = chance.randrange(7)
        if kind == 0 and out:
            out[min(at, len(out) - 1)] = chance.randrange(256)
        elif kind == 1:
            out[at:end] = b""
        elif kind == 2:
            out[at:at] = out[at:end]
        elif kind == 3:
            out[at:end] = chance.choice(WORDS)
        elif kind == 4:
            begin = chance.randrange(len(other) + 1)
            out[at:end] = other[begin:begin + end - at]
        elif kind == 5 and out:
            out[min(at, len(out) - 1)] ^= 1 << chance.randrange(8)
        else:
            out = out[:max(at, 1)] if chance.random() < 0.3 else out
    return bytes(out)


def run(inputs: int, seed: int, seconds: float, only: tuple[str, ...] = ()) -> dict[str, object]:
    """Return counts of all that was seen."""
    chance = random.Random(seed)
    faults: Counter[str] = Counter()
    counts: Counter[str] = Counter()
    worst, waited, begin = (0.0, ""), 0.0, time.perf_counter()
    with tempfile.TemporaryDirectory() as name, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        files = [f for f in sources(Path(name)) if not only or any(word in f[0].name for word in only)]
        whole = {path: path.read_bytes() for path, _ in files}
        at_start = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
        for _ in range(inputs):
            path, readers = chance.choice(files)
            target = path.with_name("bad" + path.suffix)
            content = mutated(whole[path], whole[chance.choice(files)[0]], chance)
            target.write_bytes(content)
            reader = chance.choice(readers)
            start, clock = time.process_time(), time.perf_counter()
            try:
                reader(target)
                counts["read"] += 1
            except ToolpointError as error:
                counts["refused"] += 1
                counts["by the door"] += error.__cause__ is not None
            except BaseException as error:
                if isinstance(error, KeyboardInterrupt):
                    raise
                where = f"{reader.__module__}.{reader.__name__} {path.name} {type(error).__name__}: {str(error)[:80]}"
                faults[where] += 1
            waited = max(waited, time.perf_counter() - clock)
            worst = max(worst, (time.process_time() - start, f"{reader.__module__}.{reader.__name__} {path.name}"))
            if time.perf_counter() - begin > seconds:
                break
        growth = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 - at_start
    return {"inputs": sum(counts[k] for k in ("read", "refused")) + sum(faults.values()), **counts,
            "foreign exceptions": sum(faults.values()), "faults": dict(faults), "slowest s": round(worst[0], 2),
            "slowest": worst[1], "longest by the clock s": round(waited, 2),
            "growth MB": round(growth / 1e6)}


TRACE = """<?xml version="1.0" encoding="UTF-8"?>
<root><PlatformSignalNode><int name="m_iUniqueInstanceId">1</int><TimeSeries><int name="m_TimeVector.length">2</int>
<double name="m_TimeVector.end">0.003</double><NumericArray name="y" elementtype="double" format="base85">
<unsigned_int name="m_length">2</unsigned_int><raw>....</raw></NumericArray></TimeSeries></PlatformSignalNode>
<PlatformSignalNode><int name="m_iUniqueInstanceId">2</int></PlatformSignalNode><PrimaryFreqRespSigNodeData>
<int name="m_iOutputSigNodeUniqueInstanceID">1</int><int name="m_iInputSigNodeUniqueInstanceID">2</int>
</PrimaryFreqRespSigNodeData></root>
"""

if __name__ == "__main__":
    parser = CommandLine(__doc__)
    parser.cases("inputs", 20000)
    parser.seed(1)
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.part("only", default="", about="parts of file names, commas between")
    options = parser.parse_args()
    result = run(options.inputs, options.seed, options.seconds, tuple(word for word in options.only.split(",") if word))
    for name, value in result.items():
        print(f"{name}: {value}")
    print(f"{result['foreign exceptions']} foreign exceptions in {result['inputs']} inputs, slowest {result['slowest s']} s, "
          f"growth {result['growth MB']} MB")
    if result["foreign exceptions"] or result["slowest s"] > SECONDS or result["growth MB"] * 1e6 > GROWTH:
        raise SystemExit(1)
