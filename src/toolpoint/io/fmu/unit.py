"""Functional mock-up units: a servo written as an FMI 2.0 co-simulation unit whose C source holds the exact step; write."""

from __future__ import annotations

import hashlib
import importlib.resources
import platform
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Sequence
from itertools import count as count_from
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from toolpoint._check import ToolpointError, count, fail
from toolpoint._doubt import mark_notes
from toolpoint.drives.axis.outputs import OUTPUTS
from toolpoint.drives.controller.loop_stability import check_stable
from toolpoint.drives.controller.records import CONTROL_STATE, PARAMETERS
from toolpoint.drives.controller.servo import Servo
from toolpoint.drives.friction.records import KINDS, LAW, LAW_STATE, MAX_LAW_ITERATIONS
from toolpoint.drives.simulation.arrays import MAX_LAW_PASSES, SIGNALS
from toolpoint.drives.simulation.exact_step import step_matrices
from toolpoint.io.fmu.records import enum_text, struct_text, values_text

INPUTS = (("position", "m"), ("velocity", "m/s"), ("acceleration", "m/s2"), ("load", "N"))
_OUTPUT_UNITS = {"angle": "rad", "speed": "rad/s", "scale": "m", "i_d": "A", "i_q": "A", "table": "m", "tool": "m",
                 "speed_set": "rad/s", "torque_set": "N.m", "current_set": "A", "u_d": "V", "u_q": "V",
                 "following_error": "m"}
# Controller values that the importing tool may set: field of the parameters, unit.
TUNED = (("position_gain", "1/s"), ("velocity_feedforward", "1"), ("velocity_gain", "N.m.s/rad"),
         ("velocity_integral", "N.m/rad"))
# Value references: so many for each axis, inputs from zero, outputs and tunable parameters from these on.
_REFERENCES = {"AXIS_REFERENCES": 100, "FIRST_OUTPUT": 10, "FIRST_TUNED": 50}
_BASE = {"m": "m='1'", "m/s": "m='1' s='-1'", "m/s2": "m='1' s='-2'", "N": "kg='1' m='1' s='-2'", "rad": "rad='1'",
         "rad/s": "rad='1' s='-1'", "A": "A='1'", "V": "kg='1' m='2' s='-3' A='-1'", "N.m": "kg='1' m='2' s='-2'",
         "1/s": "s='-1'", "1": "", "N.m.s/rad": "kg='1' m='2' s='-1' rad='-1'", "N.m/rad": "kg='1' m='2' s='-2' rad='-1'"}
# Names of FMI 2.0, which tools look for letter by letter.
_FOLDERS = {"linux": ("linux64", ".so"), "win32": ("win64", ".dll"), "darwin": ("darwin64", ".dylib")}


def write(servo: Servo, path: str | Path, name: str = "servo", *, substeps: int = 1, binary: bool = True,
          notes: Sequence[str] = ()) -> None:
    """Write a servo as a functional mock-up unit (FMI 2.0, co-simulation).

    Inputs are position, velocity and acceleration command (m, m/s, m/s^2; read at every position sample) and the force on
    the table (N, held over a communication step) of every axis; outputs those of a simulation. The controller's signals
    are those of the last sample before the communication point. The communication step is any whole multiple of the
    plant's step, the current sample over `substeps`.

    Parameters
    ----------
    servo : Servo
        Its loops must be stable.
    name : str
        Name of the model.
    substeps : int
        Plant steps for each current sample, as in `drives.simulate`.
    binary : bool
        Compile the library of this platform into the unit (needs a C compiler: cc, gcc or clang). The C sources are always
        in the unit; without a binary the importing tool must compile them.

    notes : sequence of str
        What its user must know, doubts about its structure above all; the description of the unit repeats them.

    The generated source is self-contained: it names the functions of the FMI standard itself and takes no header of it, so
    that nothing but this package's own licence applies. Source: FMI 2.0.4 specification, Modelica Association.

    >>> import tempfile
    """
    if not Path(path).parent.is_dir():
        raise ToolpointError(f"{path}: the folder {Path(path).parent} does not exist; create it first")
    check_stable(servo)
    count("substeps", substeps)
    identifier = re.sub(r"\W", "_", name) or "servo"
    identifier = identifier if identifier[0].isalpha() else "m_" + identifier
    texts = {name: _part(name) for name in ("servo.c", "servo_step.h")} | {
        "servo_records.h": _records(), "servo_data.h": _numbers(servo, substeps)}
    guid = "{" + hashlib.sha256("".join(texts.values()).encode()).hexdigest()[:32] + "}"
    texts["servo_data.h"] = f'#define GUID "{guid}"\n' + texts["servo_data.h"]
    described = _description(servo, name, identifier, guid, notes)
    with tempfile.TemporaryDirectory() as folder:
        inside = Path(folder)
        for part, text in texts.items():
            (inside / part).write_text(text, encoding="utf-8")
        library = _compiled(inside, identifier) if binary else None
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as unit:
            unit.writestr("modelDescription.xml", described)
            unit.writestr("documentation/licenses/LICENSE.txt", _part("licence.txt"))
            for part in texts:
                unit.write(inside / part, "sources/" + part)
            if library is not None:
                unit.write(library, f"binaries/{library.parent.name}/{library.name}")


def _part(name: str) -> str:
    return importlib.resources.files("toolpoint.io.fmu").joinpath(name).read_text(encoding="utf-8")


def _numbers(servo: Servo, substeps: int) -> str:
    """Return the header with the matrices, laws and controllers."""
    plant, current_time = servo.plant, servo.controllers[0].sample_times.current
    m = step_matrices(plant, current_time / substeps)
    sizes = {"NA": len(plant.axes), "N": m.basis.shape[1], "CORE": m.core.shape[0], "HALF": m.pairs.shape[1],
             "NS": m.scalars.shape[1], "NW": m.shift.shape[0], "NL": plant.laws.size, "NP": plant.products.shape[0],
             "ND": m.inputs.shape[0], "NY": m.reading.shape[1], "LOADED": int(m.loads.size > 0),
             **{f"COUNT_{loop.upper()}": steps * substeps for loop, steps in servo.counts._asdict().items()}}
    lines = [f"#define {key} {value}" for key, value in sizes.items()]
    lines += [f"#define STEP {m.step!r}", f'#define STEP_TEXT "{m.step:.9g}"']
    gain = np.zeros((m.scalars.shape[1], m.shift.shape[0]))
    gain[:m.gain.shape[0]] = m.gain
    arrays = {"core": m.core, "pairs": m.pairs, "inputs": m.inputs, "jump": m.jump, "scalars": m.scalars, "gain": gain,
              "reading": m.reading, "direct": m.direct, "loads": m.loads, "load_direct": m.load_direct}
    lines += [f"static const double {key}[] = {values_text(value)};" for key, value in arrays.items()]
    lines += [f"static const Law laws[] = {values_text(plant.laws)};",
              f"static const Parameters parameters[] = {values_text(_parameters(servo))};",
              f"static const int products[] = {values_text(plant.products)};"]
    return "\n".join(lines) + "\n"


def _parameters(servo: Servo) -> np.ndarray:
    return np.stack([c.parameters(a.motor) for c, a in zip(servo.controllers, servo.plant.axes, strict=True)])


def _records() -> str:
    """Return the header with the structs of laws and controllers, and the names of inputs, outputs and parameters."""
    structs = {"Law": LAW, "LawState": LAW_STATE, "Parameters": PARAMETERS, "ControlState": CONTROL_STATE}
    counts = {**KINDS, "MAX_LAW_ITERATIONS": MAX_LAW_ITERATIONS, "MAX_LAW_PASSES": MAX_LAW_PASSES, **_REFERENCES}
    inputs = np.dtype([(name, float) for name, _ in INPUTS])
    texts = [*(struct_text(name, dtype) for name, dtype in structs.items()), struct_text("Input", inputs),
             "enum { " + ", ".join(f"{name} = {value}" for name, value in counts.items()) + " };\n",
             enum_text("INPUT_", (name for name, _ in INPUTS), "INPUTS"), enum_text("OUTPUT_", OUTPUTS, "OUTPUTS"),
             enum_text("SIGNAL_", SIGNALS, "SIGNALS"), enum_text("TUNED_", (name for name, _ in TUNED), "TUNED")]
    return "/* Written by toolpoint.io.fmu from the records of the simulation: the same fields, by name. */\n" + "".join(texts)


def _description(servo: Servo, name: str, identifier: str, guid: str, notes: Sequence[str]) -> str:
    rows, outputs = [], []
    for axis, number, parameters in zip(servo.plant.axes, count_from(0, _REFERENCES["AXIS_REFERENCES"]), _parameters(servo),
                                        strict=False):
        input_rows = [(n, u, number + k, "causality='input' variability='continuous'", 0.0) for k, (n, u) in enumerate(INPUTS)]
        output_rows = [(n, _OUTPUT_UNITS[n], number + _REFERENCES["FIRST_OUTPUT"] + k,
                        "causality='output' variability='continuous' initial='calculated'", None)
                       for k, n in enumerate((*OUTPUTS, *SIGNALS))]
        tunable_rows = [(n, u, number + _REFERENCES["FIRST_TUNED"] + k,
                         "causality='parameter' variability='tunable' initial='exact'", parameters[n])
                        for k, (n, u) in enumerate(TUNED)]
        for words, unit, reference, kind, start in (*input_rows, *output_rows, *tunable_rows):
            value = "" if start is None else f" start='{float(start)!r}'"
            rows.append(f"<ScalarVariable name={quoteattr(f'{axis.name}.{words}')} valueReference='{reference}' {kind}>"
                        f"<Real unit='{unit}'{value}/></ScalarVariable>")
            if start is None:
                outputs.append(f"<Unknown index='{len(rows)}'/>")
    units = "".join(f"<Unit name='{unit}'><BaseUnit {base}/></Unit>" for unit, base in _BASE.items())
    step = servo.controllers[0].sample_times.position
    unknowns = "".join(outputs)
    remarks = f" description={quoteattr('; '.join(mark_notes(notes)))}" if notes else ""
    return (f"<?xml version='1.0' encoding='UTF-8'?>\n<fmiModelDescription fmiVersion='2.0' modelName={quoteattr(name)}"
            f"{remarks} guid='{guid}' generationTool='toolpoint' variableNamingConvention='flat' license='BSD-3-Clause'>\n"
            f"<CoSimulation modelIdentifier='{identifier}' canHandleVariableCommunicationStepSize='true' "
            f"canGetAndSetFMUstate='true' canSerializeFMUstate='true'><SourceFiles><File name='servo.c'/></SourceFiles>"
            f"</CoSimulation>\n<UnitDefinitions>{units}</UnitDefinitions>\n"
            f"<DefaultExperiment startTime='0' stepSize='{step!r}'/>\n<ModelVariables>\n" + "\n".join(rows)
            + f"\n</ModelVariables>\n<ModelStructure><Outputs>{unknowns}</Outputs><InitialUnknowns>{unknowns}"
            f"</InitialUnknowns></ModelStructure>\n</fmiModelDescription>\n")


def _compiled(folder: Path, identifier: str) -> Path:
    """Return the library of this platform."""
    compiler = next((path for path in map(shutil.which, ("cc", "gcc", "clang")) if path), None)
    where = _FOLDERS.get(sys.platform)
    if compiler is None or where is None or platform.machine().lower() not in ("x86_64", "amd64"):
        fail("fmu", f"no C compiler for {sys.platform} on {platform.machine()}", "must be cc, gcc or clang on x86-64",
             remedy="install one, or write the unit with its sources only (binary=False, --fmu-sources)")
    out = folder / where[0] / (identifier + where[1])
    out.parent.mkdir()
    flags = ["-O2", "-std=c99", "-shared", "-fPIC", "-fvisibility=hidden", "-ffp-contract=off"]
    command = [compiler, *flags, "-o", str(out), str(folder / "servo.c"), "-lm"]
    compilation = subprocess.run(command, capture_output=True, text=True, check=False)
    if compilation.returncode:
        raise ToolpointError(f"fmu: {compiler} failed: {compilation.stderr.strip()[:400]}")
    return out
