"""Raw hammer records of random machines as files of WAV, universal and text, with what goes wrong in a shop.

The machines: benchmarks/joint_identification/joint_machines.py, three to seven bodies, all laws of damping. Two places
are struck, a sensor of three directions roves: a file of three blows a point, made in the frequency domain from the direct
solution of the machine's own matrices (loss factors as they are) with the sensor's mass on it, so nothing of the package's time
domain is in them. Blows vary in force and tip; 2 to 10 % of them are bad (double, overloaded, weak), noise is 1 to 5 % of every
channel's rms after the blow, sensors are calibrated within 1 %, masses told within 2 %, coordinates within 2 mm.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import combinations
from pathlib import Path

import numpy as np
import scipy.io.wavfile
import scipy.linalg

from benchmarks.joint_identification import joint_machines as jm
from toolpoint.io import uff
from toolpoint.machine import assemble, build
from toolpoint.studies.measured.model_correlation import with_measured_points
from toolpoint.vibration import Dof, Record, SecondOrderSystem, eigen

FORMATS = ("wav", "uff", "csv")
BLOWS, BLOW_TIME, FIRST_BLOW, QUIET_END = 3, 4.0, 0.4, 12.0  # a file; s between blows, before the first, after the last
HEAVIEST_SENSOR = 0.2  # kg, with its magnet; what a machine's test uses
CALIBRATION_DEVIATION, MASS_DEVIATION, COORDINATE_DEVIATION = 0.01, 0.02, 0.002
# Volts per N and per m/s^2 of the three directions: two ranges, so that exchanged sensitivities are wrong numbers.
SENSITIVITIES = (2.25e-3, 10.2e-3, 10.4e-3, 51.0e-3)
SENSITIVITY_WORDS = ("2.25 mV/N", "10.2 mV/(m/s^2)", "10.4 mV/(m/s^2)", "51 mV/(m/s^2)")
GENERAL_SLIPS = ("sign", "exchanged", "sensitivity", "order", "mass", "direction", "coordinates")
RAW_SLIPS = ("sensitivities", "sensor mass", "soft tip", "rate", "no scale", "decimal comma", "late trigger", "window",
             "records", "other side", "unit", "other spot", "force gain")


@dataclass
class RawTest:
    """Everything of a test that a slip can change: what the tester writes down and what the files hold."""

    case: jm.Case
    rng: np.random.Generator
    kind: str
    struck: list[Dof]
    coordinates: dict
    masses: dict[str, float]
    records: dict[tuple[str, Dof], np.ndarray]
    rate: float
    sensor_mass: float
    order: dict[str, str] | None = None
    words: list[set[str]] = field(default_factory=list)
    sensitivity_words: list[str] = field(default_factory=lambda: list(SENSITIVITY_WORDS))
    full_scale: str = "10 V"
    rates: dict[tuple[str, Dof], float] = field(default_factory=dict)
    decimal_comma: tuple[str, Dof] | None = None
    is_mass_told: bool = True

    def random_file(self) -> tuple[str, Dof]:
        """Return the point and struck Dof of one file."""
        return list(self.records)[int(self.rng.integers(len(self.records)))]


def random_test(seed: int, law: str, slip: str, heaviest: float = HEAVIEST_SENSOR) -> RawTest:
    """Return the raw test of a seed, with a slip or without (""); heaviest : kg, the sensor's mass is 0.1 to 1 of it."""
    rng = np.random.default_rng(70_000 + seed)
    count = int(rng.integers(3, 8))
    case = jm.random_case(seed, law, (count, max(24, 6 * count)))
    kind = {"sensitivities": "wav", "no scale": "wav", "decimal comma": "csv", "unit": "csv"}.get(slip, FORMATS[seed % 3])
    test = _struck_machine(case, rng, kind, 3.2 if slip == "soft tip" else 0.9, heaviest * (3 if slip == "sensor mass" else 1))
    if slip:
        SLIPS[slip](test)
    return test


def _struck_machine(case: jm.Case, rng: np.random.Generator, kind: str, contact: float, heaviest: float) -> RawTest:
    """Return the test of a careful tester with usual errors; contact : duration of a blow, over the shortest period."""
    machine = with_measured_points(case.machine, case.points.coordinates, case.points.components)
    labels = [Dof(point, way) for point in case.points.places for way in ("+x", "+y", "+z")]
    system = assemble(build(replace(machine.description, modal_damping="")), outputs=labels)
    modes = eigen.solve_undamped(replace(system, damping=None, structural_damping=None))
    share = np.abs(modes.shape) / np.abs(modes.shape).max(axis=0)
    first = int(np.argmax(share.min(axis=1)))
    second = int(np.argmax(np.maximum(share, share[first]).min(axis=1) + 0.01 * share.mean(axis=1)))
    struck = [labels[k] for k in dict.fromkeys((first, second))]
    highest = float(modes.frequency[-1])
    rate = float(next(r for r in (256, 512, 800, 1024, 1280, 1600) if r >= 2.56 * (1.3 * highest + 10)))
    blower = _Blower(system, machine.description.modal_damping, rate, contact / highest, rng, case.noise)
    gains = np.exp(CALIBRATION_DEVIATION * rng.normal(size=4))
    sensor_mass = heaviest * float(rng.uniform(0.1, 1.0))
    files = [(str(point), dof) for dof in struck for point in case.points.places]
    n_bad = max(1, round(float(rng.uniform(0.02, 0.1)) * BLOWS * len(files)))
    bad = {int(k): str(rng.choice(["double", "overload", "weak"])) for k in rng.choice(len(files), n_bad, replace=False)}
    records = {}
    for number, (point, dof) in enumerate(files):
        rows = [k for k, label in enumerate(labels) if str(label.point) == point]
        records[point, dof] = gains * blower.record(rows, labels.index(dof), sensor_mass, bad.get(number, ""))
    coordinates = {name: place + COORDINATE_DEVIATION * rng.normal(size=3)
                   for name, place in case.points.coordinates.items()}
    masses = {name: float(np.exp(MASS_DEVIATION * rng.normal())) for name in case.machine.description.bodies}
    return RawTest(case, rng, kind, struck, coordinates, masses, records, rate, sensor_mass)


@dataclass
class _Blower:
    """Strikes a system (its matrices as they are) with a sensor of some mass on it."""

    system: SecondOrderSystem
    modal_damping: str
    rate: float
    contact: float
    rng: np.random.Generator
    noise: float

    def record(self, rows: list[int], struck: int, mass: float, fault: str) -> np.ndarray:
        """Return force (N) and accelerations (m/s^2) of a file of blows, (n, 4)."""
        rng, fine = self.rng, 8
        kept = round((FIRST_BLOW + BLOWS * BLOW_TIME) * self.rate)
        n = kept + round(QUIET_END * self.rate)
        time = np.arange(n * fine) / (self.rate * fine)
        force = np.zeros(n * fine)
        for blow in range(BLOWS):
            is_bad = fault and blow == 1
            contact, size = self.contact * rng.uniform(0.85, 1.15), 1500.0 * rng.uniform(0.6, 1.4)
            size *= 0.05 if is_bad and fault == "weak" else 1.0
            start = FIRST_BLOW + blow * BLOW_TIME + rng.uniform(-0.03, 0.03)
            force += _pulse((time - start) / contact) * size
            if is_bad and fault == "double":
                force += _pulse((time - start - rng.uniform(3, 8) * contact) / contact) * 0.4 * size
        spectrum = np.fft.rfft(force)[:n // 2 + 1] / fine
        lines = np.fft.rfftfreq(n, 1 / self.rate)
        spectrum = spectrum * 1 / (1 + (lines / (0.44 * self.rate)) ** 24)  # the front end's filter, the same in all channels
        response = self._accelerance(lines, rows, struck, mass)
        spectra = np.column_stack([spectrum, response * spectrum[:, None]])
        samples = np.fft.irfft(spectra, n, axis=0)[:kept]
        level = self.noise * np.sqrt((samples**2).mean(axis=0))
        samples = samples + level * rng.normal(size=samples.shape)
        if fault == "overload":
            middle = slice(round((FIRST_BLOW + 0.8 * BLOW_TIME) * self.rate), round((FIRST_BLOW + 1.8 * BLOW_TIME) * self.rate))
            channel = int(rng.integers(4))
            limit = 0.6 * np.abs(samples[middle, channel]).max()
            samples[middle, channel] = np.clip(samples[middle, channel], -limit, limit)
        return samples

    def _accelerance(self, lines: np.ndarray, rows: list[int], struck: int, mass: float) -> np.ndarray:
        """Return accelerances (n_f, 3) of the machine with the sensor on it, solved line by line."""
        s = self.system
        zero = np.zeros_like(s.mass)
        structural = zero if s.structural_damping is None else s.structural_damping
        viscous = zero if s.damping is None else s.damping
        if self.modal_damping == "energy":
            squares, shapes = scipy.linalg.eigh(s.stiffness, s.mass)
            loss = np.diag(shapes.T @ structural @ shapes) / np.sqrt(squares) + np.diag(shapes.T @ viscous @ shapes)
            viscous, structural = s.mass @ shapes @ np.diag(loss) @ shapes.T @ s.mass, zero
        outputs = s.output_map[rows]
        loaded = s.mass + mass * outputs.T @ outputs
        omega = 2 * np.pi * lines[:, None, None]
        z = s.stiffness + 1j * structural * (omega > 0) + 1j * omega * viscous - omega**2 * loaded
        motion = np.linalg.solve(z, np.broadcast_to(s.output_map[struck][:, None], (lines.size, s.mass.shape[0], 1)))
        return -(omega**2 * (outputs @ motion))[:, :, 0]


def _pulse(phase: np.ndarray) -> np.ndarray:
    return np.where((phase > 0) & (phase < 1), np.sin(np.pi * np.clip(phase, 0, 1)), 0.0)


# Slips: each changes one thing of the test, and says of which words one set must be in one doubt or message.

def _turn_sign(test: RawTest) -> None:
    channel, file = int(test.rng.integers(1, 4)), test.random_file()
    for key in test.records:  # the sensor was mounted the other way round at one point
        if key[0] == file[0]:
            test.records[key] = test.records[key] * np.where(np.arange(4) == channel, -1.0, 1.0)
    test.words = [{file[0]}]


def _exchange_points(test: RawTest) -> None:
    names = list(test.coordinates)
    first = names[int(test.rng.integers(len(names)))]
    other = max(names, key=lambda name: np.linalg.norm(test.coordinates[name] - test.coordinates[first]))
    test.coordinates[first], test.coordinates[other] = test.coordinates[other], test.coordinates[first]
    test.words = [{str(first)}, {str(other)}]


def _exchange_points_of_body(test: RawTest) -> None:
    groups = list(test.case.points.components.values())
    first, other = test.rng.choice(groups[int(test.rng.integers(len(groups)))], 2, replace=False).tolist()
    test.coordinates[first], test.coordinates[other] = test.coordinates[other], test.coordinates[first]
    test.words = [{str(first), str(other), "exchanged"}]


def _scale_point(test: RawTest) -> None:
    file = test.random_file()
    for key in test.records:  # another gain at the amplifier while this point was measured
        if key[0] == file[0]:
            test.records[key] = test.records[key] * np.array([1.0, 1.2, 1.2, 1.2])
    test.words = [{file[0]}]


def _wrong_order(test: RawTest) -> None:
    parents = {joint.child: joint.parent for joint in test.case.machine.description.joints.values()}
    for first, second in sorted(combinations(parents, 2), key=lambda pair: "b0" in pair):
        swap = {first: second, second: first}
        test.order = {swap.get(child, child): swap.get(parent, parent) for child, parent in parents.items()}
        if test.order != parents:  # two that hang on one body are no wrong order
            break
    test.words = [{"chain"}, {"order"}, {"carries"}]


def _wrong_mass(test: RawTest) -> None:
    name = list(test.masses)[int(test.rng.integers(len(test.masses)))]
    test.masses[name] *= 1.10
    test.words = [{name, "mass"}]


def _turn_sensor(test: RawTest) -> None:
    file = test.random_file()
    for key in test.records:  # x along y, y against x
        if key[0] == file[0]:
            test.records[key] = test.records[key][:, [0, 2, 1, 3]] * np.array([1.0, 1.0, -1.0, 1.0])
    test.words = [{file[0]}]


def _move_point(test: RawTest) -> None:
    names = list(test.coordinates)
    name = names[int(test.rng.integers(len(names)))]
    test.coordinates[name] = test.coordinates[name] + np.array([0.0, 0.3, 0.0])
    test.words = [{str(name)}]


def _exchange_sensitivities(test: RawTest) -> None:
    test.sensitivity_words[2], test.sensitivity_words[3] = test.sensitivity_words[3], test.sensitivity_words[2]
    test.words = [{"y"}, {"z"}, {"+y"}, {"+z"}, {"sensitivity"}, {"gain"}, {"calibration"}, {"direction"}, {"directions"}]


def _forget_sensor_mass(test: RawTest) -> None:
    test.is_mass_told = False
    test.words = [{"sensor"}, {"sensor's"}]


def _soft_tip(test: RawTest) -> None:
    test.words = [{"tip"}, {"force"}, {"band"}, {"excite"}]


def _wrong_rate(test: RawTest) -> None:
    file = test.random_file()
    test.rates[file] = 2 * test.rate
    test.words = [{_stem(*file)}]


def _no_scale(test: RawTest) -> None:
    test.full_scale = ""
    test.words = [{"full", "scale"}]


def _decimal_comma(test: RawTest) -> None:
    test.decimal_comma = test.random_file()
    test.words = [{_stem(*test.decimal_comma)}]


def _late_trigger(test: RawTest) -> None:
    file = test.random_file()
    samples = test.records[file]
    peak = int(np.argmax(samples[:round((FIRST_BLOW + 0.5) * test.rate), 0]))
    test.records[file] = samples[peak:]
    test.words = [{_stem(*file)}]


def _analyser_window(test: RawTest) -> None:
    for key, samples in test.records.items():  # every blow windowed down to 2 % before it was stored
        step, first = round(BLOW_TIME * test.rate), round((FIRST_BLOW - 0.15) * test.rate)
        place = np.maximum(np.arange(len(samples)) - first, 0) % step
        test.records[key] = samples * np.exp(np.log(0.02) * np.maximum(place - round(0.15 * test.rate), 0) / step)[:, None]
    test.words = [{"window"}]


def _exchange_records(test: RawTest) -> None:
    keys = [key for key in test.records if key[1] == test.struck[0]]
    first = keys[int(test.rng.integers(len(keys)))]
    places = {str(name): place for name, place in test.case.points.coordinates.items()}
    other = max(keys, key=lambda key: np.linalg.norm(places[key[0]] - places[first[0]]))
    test.records[first], test.records[other] = test.records[other], test.records[first]
    test.words = [{first[0]}, {other[0]}]


def _other_side(test: RawTest) -> None:
    file = test.random_file()
    test.records[file] = test.records[file] * np.array([1.0, -1.0, -1.0, -1.0])  # struck from the other side of the plate
    test.words = [{file[0]}, {_stem(*file)}]


def _file_in_g(test: RawTest) -> None:
    file = test.random_file()
    test.records[file] = test.records[file] / np.array([1.0, 9.80665, 9.80665, 9.80665])
    test.words = [{file[0]}, {_stem(*file)}]


def _other_spot(test: RawTest) -> None:
    keys = [key for key in test.records if key[1] == test.struck[-1]]
    file = keys[int(test.rng.integers(len(keys)))]
    other = (file[0], test.struck[0]) if len(test.struck) > 1 else keys[0]
    test.records[file] = test.records[other]  # struck where the other series was
    test.words = [{file[0]}, {_stem(*file)}]


def _force_gain(test: RawTest) -> None:
    for key in test.records:  # the hammer's range was changed before the second series
        if key[1] == test.struck[-1]:
            test.records[key] = test.records[key] * np.array([2.0, 1.0, 1.0, 1.0])
    test.words = [{str(test.struck[-1])}, {"gain"}, {"scale"}, {"factor"}, {"mass"}]


SLIPS: dict[str, Callable[[RawTest], None]] = {
    "sign": _turn_sign, "exchanged": _exchange_points, "exchanged in a body": _exchange_points_of_body,
    "sensitivity": _scale_point, "order": _wrong_order, "mass": _wrong_mass,
    "direction": _turn_sensor, "coordinates": _move_point, "sensitivities": _exchange_sensitivities,
    "sensor mass": _forget_sensor_mass, "soft tip": _soft_tip,
    "rate": _wrong_rate, "no scale": _no_scale, "decimal comma": _decimal_comma, "late trigger": _late_trigger,
    "window": _analyser_window, "records": _exchange_records, "other side": _other_side, "unit": _file_in_g,
    "other spot": _other_spot, "force gain": _force_gain}


def _stem(point: str, struck: Dof) -> str:
    way = struck.direction.replace("+", "p").replace("-", "m")
    return f"S{struck.point}{way}_P{point}"


def write_raw(test: RawTest, folder: Path) -> None:
    """Write the records, the test file, the points and the components of a test."""
    (folder / "records").mkdir()
    for (point, dof), samples in test.records.items():
        _write_file(test, folder / "records", (point, dof), samples)
    (folder / "records" / "test.yaml").write_text(_test_text(test))
    rows = [f"{name},{','.join(f'{value:.5f}' for value in place)}" for name, place in test.coordinates.items()]
    (folder / "points.csv").write_text("\n".join(["point,x [m],y [m],z [m]", *rows]) + "\n")
    text = jm.component_text(test.case, test.masses, test.order, "coordinate_deviation: 2 mm\ncalibration_deviation: 1 %\n",
                             f"{100 * MASS_DEVIATION:g} %")
    (folder / "components.yaml").write_text(text)


def _write_file(test: RawTest, folder: Path, key: tuple[str, Dof], samples: np.ndarray) -> None:
    point, dof = key
    rate, stem = test.rates.get(key, test.rate), _stem(*key)
    if test.kind == "wav":  # 24 bits of 10 V, as a sound card or a front end stores them
        shares = np.clip(samples * SENSITIVITIES / 10.0, -1, 1 - 2.0**-31)
        scipy.io.wavfile.write(folder / f"{stem}.wav", int(rate), (np.round(shares * 2**23) * 256).astype(np.int32))
    elif test.kind == "uff":
        labels = [dof, *(Dof(int(point), way) for way in ("+x", "+y", "+z"))]
        record = Record(samples, rate, labels, ("force", "acceleration", "acceleration", "acceleration"))
        uff.write(folder / f"{stem}.uff", record, text=int(point) % 5 == 0)
    else:
        time = np.arange(len(samples)) / rate
        lines = ["Logger 4711;;;;", "time [s];hammer [N];ax [m/s^2];ay [m/s^2];az [m/s^2]"]
        lines += [";".join(f"{value:.6g}" for value in row) for row in np.column_stack([time, samples]).tolist()]
        text = "\n".join(lines) + "\n"
        if test.decimal_comma == key:  # saved anew by a program with decimal commas and comma separators
            text = text.replace(".", ",").replace(";", ",")
        (folder / f"{stem}.csv").write_text(text)


def _test_text(test: RawTest) -> str:
    lines = ["toolpoint: 1", "test: random machine, two places struck, one sensor moved", "records:"]
    for dof in test.struck:
        pattern = _stem("*", dof)
        named = f', pattern: "{_stem("{output}", dof)}"' if test.kind != "uff" else ""
        lines.append(f'  - {{files: ["{pattern}.{test.kind}"], struck: "{dof}"{named}}}')
    if test.kind == "uff":
        return "\n".join(lines) + "\n"
    lines.append("channels:")
    for number, quantity in enumerate(("force", *["acceleration"] * 3)):
        place = f'"{test.struck[0]}"' if number == 0 else f'"*:+{"xyz"[number - 1]}"'
        told = f", sensitivity: {test.sensitivity_words[number]}" if test.kind == "wav" else ""
        scale = f", full_scale: {test.full_scale}" if test.kind == "wav" and test.full_scale else ""
        told += f", mass: {1e3 * test.sensor_mass:.3g} g" if number and test.is_mass_told else ""
        lines.append(f'  - {{channel: "{number + 1}", quantity: {quantity}, dof: {place}{told}{scale}}}')
    return "\n".join(lines) + "\n"
