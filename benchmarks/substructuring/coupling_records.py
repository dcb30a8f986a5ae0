"""Receptance coupling as a user does it: whether the stated intervals of an unmeasured tool hold the truth; slips of the test.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 \
        python benchmarks/substructuring/coupling_records.py [--runs 30] [--noise 0.5 2 5] [--slips 12]

Random spindles: a shaft of two to five diameters on two or three bearings, a housing with modes of its own, a taper that gives
way, a holder; damping of 0.5 to 5 %. Random gauges with two or three stations, struck and measured at all of them, with noise
of the stated per cent of each response and a floor of the sensor (the same acceleration at all lines); a hammer and a sensor
that read up to 1 % too much or too little. The truth is the same spindle with a random end mill. Beams here are written as
a system of first order, :math:`y' = A(\\omega) y` with y of deflection, turn, moment and shear force, and carried by matrix
exponentials: nothing of the package's segments is used. The last line is the figure.
"""

from __future__ import annotations

import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np
from scipy.signal import find_peaks

from benchmarks.frame import CommandLine
from toolpoint import io
from toolpoint.studies import bases_from_gauge, study_tool
from toolpoint.studies.cuts.coupling.peaks import peaks_of
from toolpoint.studies.cuts.tool_coupling import ToolCoupling
from toolpoint.substructuring import SegmentDescription, ShaftDescription
from toolpoint.vibration import Dof, Frf

STEEL, CARBIDE = (210e9, 7850.0, 0.30), (580e9, 14500.0, 0.22)
CUT = {"teeth": 4, "diameter": 0.016, "immersion": 0.5, "direction": "down", "kt": 7e8, "kn": 2.1e8}


@dataclass(frozen=True)
class Beam:
    """A round piece: length, diameter, bore (m), Young's modulus, density, Poisson's ratio, loss factor."""

    length: float
    diameter: float
    bore: float = 0.0
    material: tuple[float, float, float] = STEEL
    loss: float = 0.002

    def stiffness(self, w: np.ndarray) -> np.ndarray:
        """Return the dynamic stiffness of both ends (n, 4, 4) over deflection and turn."""
        e, rho, nu = self.material
        e = e * (1 + 1j * self.loss)
        m2 = (self.bore / self.diameter) ** 2
        kappa = 6 * (1 + nu) * (1 + m2) ** 2 / ((7 + 6 * nu) * (1 + m2) ** 2 + (20 + 12 * nu) * m2)
        area, second = np.pi / 4 * (self.diameter**2 - self.bore**2), np.pi / 64 * (self.diameter**4 - self.bore**4)
        shear, length = kappa * e / (2 * (1 + nu)) * area, self.length
        a = np.zeros((w.size, 4, 4), complex)  # w' = t + Q/(kGA), t' = M/EI, M' = -Q - rho I w^2 t, Q' = -rho A w^2 w
        a[:, 0, 1], a[:, 0, 3], a[:, 1, 2], a[:, 2, 3] = 1, e * second / (shear * length**2), 1, -1
        a[:, 2, 1], a[:, 3, 0] = -rho * w**2 * length**2 / e, -rho * area * w**2 * length**4 / (e * second)
        t = exponential(a)
        back = np.linalg.inv(t[:, :2][:, :, [3, 2]])  # (w, t) of the far end from (Q, M) of the near one
        near = np.concatenate([-back @ t[:, :2, :2], back], axis=2)
        far = np.concatenate([t[:, [3, 2], :2], np.zeros((w.size, 2, 2))], axis=2) + t[:, [3, 2]][:, :, [3, 2]] @ near
        forces = np.concatenate([-near, far], axis=1)
        place = np.array([length, 1.0, length, 1.0])  # of deflection; forces are EI/L^2 and EI/L
        force = e * second / length**2 * np.array([1.0, length, 1.0, length])
        return np.asarray(force[:, None] * forces / place)


def exponential(a: np.ndarray) -> np.ndarray:
    """Return exp of matrices (n, 4, 4): Taylor's series of the halved matrix, squared."""
    times = max(0, int(np.ceil(np.log2(np.abs(a).sum(axis=1).max()))) + 2)
    a = a / 2**times
    total = term = np.broadcast_to(np.eye(4, dtype=complex), a.shape)
    for k in range(1, 13):
        term = term @ a / k
        total = total + term
    for _ in range(times):
        total = total @ total
    return np.asarray(total)


def chain(w: np.ndarray, beams: list[Beam]) -> np.ndarray:
    """Return the dynamic stiffness of a free row of beams over its sections."""
    whole = np.zeros((w.size, 2 * len(beams) + 2, 2 * len(beams) + 2), complex)
    for k, beam in enumerate(beams):
        whole[:, 2 * k:2 * k + 4, 2 * k:2 * k + 4] += beam.stiffness(w)
    return whole


def joined(base: np.ndarray, shaft: np.ndarray) -> np.ndarray:
    """Return the responses of a shaft (stiffness over its sections) whose first section is held by a base (receptance)."""
    n = shaft.shape[1]
    matrix = np.zeros((len(base), n + 2, n + 2), complex)
    matrix[:, :n, :n], matrix[:, n:, n:] = shaft, -base
    matrix[:, [0, 1], [n, n + 1]] = matrix[:, [n, n + 1], [0, 1]] = 1
    size = 1 / np.sqrt(np.abs(matrix).max(axis=2))
    inverse = np.linalg.inv(size[:, :, None] * matrix * size[:, None, :])
    return np.asarray((size[:, :, None] * inverse * size[:, None, :])[:, :n, :n])


@dataclass(frozen=True)
class Case:
    """A spindle at its nose (n, 2, 2), a gauge with its stations, a tool as it is and as it is described."""

    frequency: np.ndarray
    base: Callable[[np.ndarray], np.ndarray]
    gauge: ShaftDescription
    tool: ShaftDescription
    gauge_beam: Beam
    tool_beams: list[Beam]

    def measured(self) -> np.ndarray:
        """Return the responses among the gauge's stations without noise."""
        w = 2 * np.pi * self.frequency
        cuts = sorted(self.gauge.stations.values())
        edges = [0.0, *cuts, self.gauge_beam.length]
        pieces = [replace(self.gauge_beam, length=b - a) for a, b in pairwise(edges) if b - a > 1e-9]
        at = [2 * (cuts.index(s) + 1) for s in self.gauge.stations.values()]
        return joined(self.base(w), chain(w, pieces))[:, at][:, :, at]

    def tip(self, frequency: np.ndarray) -> np.ndarray:
        """Return the true receptance at the tool's tip."""
        w = 2 * np.pi * frequency
        return joined(self.base(w), chain(w, self.tool_beams))[:, -2, -2]


def random_case(rng: np.random.Generator) -> Case:
    """Return a random spindle, gauge and tool."""
    low, high = rng.uniform(40, 100), rng.uniform(3000, 4500)
    zeta = np.exp(rng.uniform(np.log(0.005), np.log(0.05)))
    step = float(np.clip(0.5 * zeta * 800, 1.5, 4.0))
    holder = rng.uniform(0.032, 0.05)
    gauge_beam = Beam(rng.uniform(0.06, 0.1), rng.uniform(0.6, 1.0) * holder, loss=1e-3)
    count, length = int(rng.integers(2, 4)), gauge_beam.length
    places = np.sort(np.array([0.97, rng.uniform(0.2, 0.35), rng.uniform(0.55, 0.7)])[:count] * length)[::-1]
    gauge = ShaftDescription({"bar": SegmentDescription(length, gauge_beam.diameter, loss_factor=1e-3)},
                             stations={str(k + 1): float(p) for k, p in enumerate(places)})
    thick, name = float(rng.choice([0.008, 0.01, 0.012, 0.016, 0.02])), str(rng.choice(["carbide", "carbide", "steel"]))
    out, material, edge = rng.uniform(3, 8) * thick, CARBIDE if name == "carbide" else STEEL, rng.uniform(1.0, 2.0) * thick
    tool_beams = [Beam(out - edge, thick, 0.0, material, 0.002), Beam(edge, 0.8 * thick, 0.0, material, 0.002)]
    tool = ShaftDescription({"blank": SegmentDescription(out - edge, thick, material=name, loss_factor=0.002),
                             "flutes": SegmentDescription(edge, thick, material=name, fluted=True, loss_factor=0.002)})
    return Case(np.arange(low, high, step), random_spindle(rng, zeta, holder), gauge, tool, gauge_beam, tool_beams)


def random_spindle(rng: np.random.Generator, zeta: float, holder: float) -> Callable[[np.ndarray], np.ndarray]:
    """Return the receptance of a spindle's nose with a holder in it: shaft on bearings, taper, holder; a housing's modes."""
    pieces = [Beam(rng.uniform(0.05, 0.12), rng.uniform(0.05, 0.085), rng.uniform(0.01, 0.03), loss=zeta)
              for _ in range(int(rng.integers(3, 6)))]
    bearings = {0: 10 ** rng.uniform(7.7, 8.5), len(pieces) - 1: 10 ** rng.uniform(8, 8.8)}
    if len(pieces) > 3:
        bearings[1] = 10 ** rng.uniform(7.7, 8.5)
    taper = (10 ** rng.uniform(8.3, 9.2), 10 ** rng.uniform(5.3, 6.2))
    row = [Beam(rng.uniform(0.03, 0.05), 1.5 * holder, loss=zeta), Beam(rng.uniform(0.02, 0.06), holder, loss=zeta)]
    housing = [(rng.uniform(30, 900), zeta * rng.uniform(0.7, 2), 10 ** rng.uniform(7.3, 9), rng.normal(0, 4))
               for _ in range(int(rng.integers(2, 6)))]

    def base(w: np.ndarray) -> np.ndarray:
        shaft = chain(w, pieces)
        for at, stiffness in bearings.items():
            shaft[:, 2 * at, 2 * at] += stiffness * (1 + 2j * zeta) + 1j * w * 2 * zeta * stiffness / 5000
        nose = np.linalg.inv(shaft)[:, -2:, -2:]
        for f, ratio, stiffness, slope in housing:
            q = w / (2 * np.pi * f)
            nose = nose + np.outer([1, slope], [1, slope]) / stiffness / (1 - q**2 + 2j * ratio * q)[:, None, None]
        nose = nose + np.diag([1 / taper[0], 1 / taper[1]]) * (1 - 2j * zeta)
        return joined(nose, chain(w, row))[:, -2:, -2:]

    return base


@dataclass(frozen=True)
class Test:
    """What the user has: responses (with or without a stated variance), gauge, tool, and what is said of the noise."""

    frf: Frf
    gauge: ShaftDescription
    tool: ShaftDescription
    noise: float | None = None


def strike(case: Case, noise: float, rng: np.random.Generator, *, gain: float = 0.01) -> Test:
    """Return the gauge test: noise in proportion and of the sensor, gains of hammer and sensor a little off."""
    clean = case.measured()
    w = 2 * np.pi * case.frequency[:, None, None]
    floor = noise * np.sqrt(np.mean(np.abs(w**2 * clean) ** 2)) * rng.uniform(0.02, 0.2) / w**2
    variance = (noise * np.abs(clean)) ** 2 + floor**2
    values = clean + np.sqrt(variance / 2) * (rng.normal(size=clean.shape) + 1j * rng.normal(size=clean.shape))
    values = values * np.exp(gain * rng.normal())
    labels = tuple(Dof(int(name), "+x") for name in case.gauge.stations)
    return Test(Frf(case.frequency, values, labels, labels, variance=variance), case.gauge, case.tool)


def as_filed(test: Test, rng: np.random.Generator) -> Test:
    """Return the test after its way through files: HDF5 with variance, or text and universal files whose noise is told."""
    kind = int(rng.integers(3))
    frf = test.frf.converted_to(str(rng.choice(["receptance", "mobility", "accelerance"])))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if kind < 2:
            path = folder / ("gauge.h5" if kind == 0 else "gauge.uff")
            io.write_frf(frf, path)
            back = io.read_frf([path])
        else:
            paths = []
            for i, o in enumerate(frf.outputs):
                for j, p in enumerate(frf.inputs):
                    paths.append(folder / f"{o.point}=+x__{p.point}=+x.txt")
                    v = frf.values[:, i, j]
                    np.savetxt(paths[-1], np.stack([frf.frequency, v.real, v.imag], axis=1), header="Hz real imaginary")
            back = io.read_frf(paths, quantity=frf.quantity)
    return replace(test, frf=back if back.variance is not None else replace(back, variance=frf.variance))


def coupled(test: Test, *, draws: int = 200, cut: dict[str, object] | None = None) -> ToolCoupling:
    """Return what the package says."""
    rng = np.random.default_rng(1)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        bases = bases_from_gauge(test.frf, test.gauge, noise=test.noise, draws=draws, generator=rng)
        return study_tool(bases, test.tool, cut=cut, speeds=np.linspace(3000, 20000, 12), generator=rng)


def true_peak(case: Case, near: float | None = None) -> tuple[float, float]:
    """Return frequency and height of the largest true peak of the band, or of that nearest to a frequency."""
    size = np.abs(case.tip(case.frequency))
    at, _ = find_peaks(size)
    if not at.size:
        at = np.array([np.argmax(size)])
    order = -size[at] if near is None else np.abs(np.log(case.frequency[at] / near))
    best = case.frequency[at[np.argsort(order)[:3]]]
    step = case.frequency[1] - case.frequency[0]
    lines = np.unique((best[:, None] + np.linspace(-step, step, 101)).ravel())
    size = np.abs(case.tip(lines))
    if near is not None:
        size = np.where(np.abs(lines - best[0]) <= step * (1 + 1e-9), size, 0.0)
    return float(lines[np.argmax(size)]), float(size.max())


def score(case: Case, result: ToolCoupling) -> dict[str, float]:
    """Return shares of lines held, whether the largest peak is held in frequency and height, and widths."""
    tip = result.tips[0]
    truth = case.tip(tip.frequency)
    low, high = tip.band()
    peak = peaks_of(tip)[0]
    f, height = true_peak(case, peak.frequency)
    assert peak.intervals is not None
    (f0, f1), (h0, h1) = peak.intervals
    return {"real part": float(np.mean((low.real <= truth.real) & (truth.real <= high.real))),
            "imaginary part": float(np.mean((low.imag <= truth.imag) & (truth.imag <= high.imag))),
            "peak frequency": float(f0 - 1e-9 <= f <= f1 + 1e-9), "peak height": float(h0 <= height <= h1),
            "width of lines, %": float(100 * np.median(np.abs(high - low) / 2 / np.abs(truth))),
            "width of frequency, %": 100 * (f1 - f0) / 2 / f, "width of height, %": 100 * (h1 - h0) / 2 / height,
            "off in frequency, %": 100 * abs(peak.frequency / f - 1),
            "off in height, %": 100 * abs(peak.height / height - 1),
            "doubted": float(bool(result.to_dict()["doubts"]))}


def other(gauge: ShaftDescription, length: float = 1.0, diameter: float = 1.0, modulus: float = 1.0) -> ShaftDescription:
    """Return the gauge as it is described wrongly: factors on length (stations measured from the tip), diameter, modulus."""
    bar = gauge.segments["bar"]
    changed = replace(bar, length=bar.length * length, diameter=bar.diameter * diameter, modulus=210e9 * modulus)
    stations = {k: v + bar.length * (length - 1) for k, v in gauge.stations.items()}
    return replace(gauge, segments={"bar": changed}, stations=stations)


def altered(test: Test, change: Callable[[np.ndarray], np.ndarray]) -> Test:
    """Return the test with the values of its responses changed."""
    return replace(test, frf=replace(test.frf, values=change(test.frf.values.copy())))


def scaled(test: Test, i: int, j: int, factor: complex) -> Test:
    """Return the test with one response times a factor."""
    def change(values: np.ndarray) -> np.ndarray:
        values[:, i, j] *= factor
        return values
    return altered(test, change)


def crossed(test: Test, rng: np.random.Generator) -> Test:
    """Return the test with one driving point of another plane: the same spindle a tenth softer, without its slopes."""
    def change(values: np.ndarray) -> np.ndarray:
        values[:, 0, 0] = np.interp(test.frf.frequency * 1.12, test.frf.frequency, values[:, 0, 0]) * 1.1
        return values
    return altered(test, change)


def thinned(test: Test, keep: slice) -> Test:
    """Return the test with some of its lines."""
    f = test.frf
    return replace(test, frf=Frf(f.frequency[keep], f.values[keep], f.outputs, f.inputs, f.quantity,
                                 variance=None if f.variance is None else f.variance[keep]))


def swapped(test: Test) -> Test:
    """Return the test with the names of the first and the last station exchanged."""
    names = list(test.gauge.stations)
    places = list(test.gauge.stations.values())
    places[0], places[-1] = places[-1], places[0]
    return replace(test, gauge=replace(test.gauge, stations=dict(zip(names, places, strict=True))))


def moved(test: Test, by: float) -> Test:
    """Return the test with the first station some way nearer to the base than told."""
    first, *rest = test.gauge.stations.items()
    return replace(test, gauge=replace(test.gauge, stations=dict([(first[0], first[1] - by), *rest])))


def understated(test: Test) -> Test:
    """Return the test with a quarter of its noise stated."""
    assert test.frf.variance is not None
    return replace(test, frf=replace(test.frf, variance=test.frf.variance / 16))


def longer(test: Test, by: float) -> Test:
    """Return the test with a tool whose blank is told longer than it is."""
    return replace(test, tool=test.tool.with_length("blank", test.tool.segments["blank"].length * by))


SLIPS: dict[str, Callable[[Test, np.random.Generator], Test]] = {
    "gauge told 8 % longer": lambda t, rng: replace(t, gauge=other(t.gauge, length=1.08)),
    "gauge told 8 % thicker": lambda t, rng: replace(t, gauge=other(t.gauge, diameter=1.08)),
    "gauge's modulus 10 % off": lambda t, rng: replace(t, gauge=other(t.gauge, modulus=1.1)),
    "a station 6 mm off": lambda t, rng: moved(t, 0.006),
    "stations exchanged": lambda t, rng: swapped(t),
    "one driving point of y": crossed,
    "mobility read as accelerance": lambda t, rng: replace(t, frf=replace(
        (m := t.frf.converted_to("mobility")), quantity="accelerance", variance=m.variance)),
    "accelerance read as receptance": lambda t, rng: replace(t, frf=replace(
        (m := t.frf.converted_to("accelerance")), quantity="receptance", variance=m.variance)),
    "all signs turned": lambda t, rng: altered(t, lambda v: -v),
    "one cross response turned": lambda t, rng: scaled(t, 0, 1, -1),
    "both cross responses turned": lambda t, rng: scaled(scaled(t, 0, 1, -1), 1, 0, -1),
    "driving point times 0.8": lambda t, rng: scaled(t, 0, 0, 0.8),
    "driving point times 1.2": lambda t, rng: scaled(t, 0, 0, 1.2),
    "cross response times 1.2": lambda t, rng: scaled(t, 0, 1, 1.2),
    "all responses times 1.2": lambda t, rng: altered(t, lambda v: 1.2 * v),
    "band half as wide": lambda t, rng: thinned(t, slice(0, t.frf.frequency.size // 4)),
    "lines five times as far apart": lambda t, rng: thinned(t, slice(0, None, 5)),
    "a quarter of the noise stated": lambda t, rng: understated(t),
    "noise not stated": lambda t, rng: replace(t, frf=replace(t.frf, variance=None)),
    "tool told 8 % shorter": lambda t, rng: longer(t, 0.92),
}


def slips(runs: int, seed: int) -> tuple[int, int]:
    """Print how often each slip is noticed, harmless or neither; return the counts of harmful and of those noticed."""
    harmful, seen = 0, 0
    for name, slip in SLIPS.items():
        counts = [0, 0, 0, 0]
        for k in range(runs):
            rng = np.random.default_rng([seed, 1000 + k])
            case = random_case(rng)
            test = strike(case, 0.01, rng)
            before = {n.what for n in coupled(test, draws=60).to_dict()["doubts"]}
            try:
                result = coupled(slip(test, rng), draws=60)
            except Exception:  # refused
                counts[0] += 1
                harmful, seen = harmful + 1, seen + 1
                continue
            f, height = true_peak(case)
            peak = peaks_of(result.tips[0])[0]
            held = peak.intervals is not None and peak.intervals[1][0] <= height <= peak.intervals[1][1]
            wrong = abs(peak.frequency / f - 1) > 0.02 or (abs(peak.height / height - 1) > 0.15 and not held)
            noticed = bool({n.what for n in result.to_dict()["doubts"]} - before)
            counts[(1 if noticed else 2) if wrong else 3] += 1
            harmful, seen = harmful + wrong, seen + (wrong and noticed)
        print(f"  {name:<34} refused {counts[0]:2d}, wrong and doubted {counts[1]:2d}, wrong in silence {counts[2]:2d}, "
              f"harmless {counts[3]:2d}", flush=True)
    return harmful, seen


def main() -> None:
    """Run and print."""
    parser = CommandLine(__doc__)
    parser.cases("runs", 30)
    parser.add_argument("--noise", type=float, nargs="*", default=[0.5, 2.0, 5.0])
    parser.seed(0)
    parser.add_argument("--slips", type=int, default=10)
    parser.add_argument("--gain", type=float, default=0.01)
    given = parser.parse_args()
    last: list[str] = []
    for noise in given.noise:
        rows = []
        start = time.process_time()
        for k in range(given.runs):
            rng = np.random.default_rng([given.seed, k])
            case = random_case(rng)
            test = as_filed(strike(case, noise / 100, rng, gain=given.gain), rng)
            result = coupled(test)
            rows.append(score(case, result))
        bad = [bool(abs(r["off in height, %"]) > 20 or r["off in frequency, %"] > 2) for r in rows]
        doubted = [bool(r["doubted"]) for r in rows]
        both = sum(a and b for a, b in zip(bad, doubted, strict=True))
        print(f"largest peak off by 20 % or 2 % of its frequency: {sum(bad)}, doubted {both}; others {len(bad) - sum(bad)}, "
              f"doubted {sum(doubted) - both}")
        print(f"noise {noise:g} %, {given.runs} tests, {(time.process_time() - start) / given.runs:.1f} s each")
        for key in rows[0]:
            v = np.array([row[key] for row in rows])
            print(f"  {key:<26}{np.mean(v):8.3g}  median {np.median(v):8.3g}  90 % {np.percentile(v, 90):8.3g}", flush=True)
        last.append(f"{noise:g} %: lines {100 * np.mean([r['real part'] for r in rows]):.0f} %, peaks "
                    f"{100 * np.mean([r['peak frequency'] for r in rows]):.0f} % in frequency and "
                    f"{100 * np.mean([r['peak height'] for r in rows]):.0f} % in height")
    harmful, seen = slips(given.slips, given.seed) if given.slips else (0, 0)
    print(f"95 % intervals hold at noise of {'; '.join(last)}; slips that move the largest peak by 2 % or 15 %: {seen} of "
          f"{harmful} doubted or refused")


if __name__ == "__main__":
    main()
