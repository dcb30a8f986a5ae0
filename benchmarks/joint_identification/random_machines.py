"""Random machines from noisy responses to machine files by command, nobody choosing; then asked at poses nobody tested.

The machines: benchmarks/joint_identification/joint_machines.py. Every machine: responses written as a universal file,
`toolpoint joints ... --machine`, `toolpoint check`, then frequencies, receptances and depth limits of the written machine
beside those of the true one at five random poses, with the intervals of its covariance.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 \
        python benchmarks/joint_identification/random_machines.py [--first 0] [--seeds 200] [--case plain]
        [--results FILE] (resumes from it) [--without-limits] [--laws] [--poses 5] [--size 2 6]

Limits are charted at sixteen speeds, their intervals come from eight samples. With --laws half of the machines have real shapes
and a fifth viscous joints (`joint_machines.law_of`), and the true limits are those of the full complex response (direct
solution) by the engine that takes responses (`HillDeterminant`); beside `lobes` of the written file also those of its own full
response.

Cases: plain, sensor (one turned), calibration (one channel 20 % off), hits (responses of one point averaged with bad ones),
coordinates (10 mm, told), masses (10 %, told), scale (masses 10 % off one by one and 15 % together, told as 20 %; all responses
too large or small by 2 %, told), order (a wrong tree, not told).
"""

from __future__ import annotations

import contextlib
import io
import json
import sys
import tempfile
import time
import warnings
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine, read_rows
from benchmarks.joint_identification import joint_machines as jm
from toolpoint.app.main import main as command
from toolpoint.cutting import HillDeterminant
from toolpoint.io.yaml import machine_file
from toolpoint.joint_identification.joints.kinds import unit_twists
from toolpoint.machine import assemble
from toolpoint.machine.description.frames import frame
from toolpoint.spatial import transform as tf
from toolpoint.studies.machines.machine_uncertainty import machine_uncertainty
from toolpoint.studies.machines.tool_point import deep_chart, lobes, milling_problem, tool_point
from toolpoint.vibration import frequency_response

CASES = ("plain", "sensor", "calibration", "hits", "coordinates", "masses", "scale", "order")
SPEEDS = np.linspace(800.0, 4000.0, 16)
SAMPLES = 8
LINES = np.arange(0.05, 1000.0, 0.05)  # Hz, of the full responses
ENGINES = 2e-4  # relative error of a limit that the engine's lines leave
STUDENT = 2.3646  # 97.5 % quantile with seven degrees of freedom


def spoilt(case, frf, rng, kind):
    """Return (responses, coordinates, mass factors, order, further lines of the file) of a spoilt test."""
    values, coordinates = frf.values.copy(), dict(case.points.coordinates)
    masses, order, extra = {}, None, ""
    channel = int(rng.integers(len(frf.outputs)))
    if kind == "sensor":
        values[:, channel] *= -1
    elif kind == "calibration":
        values[:, channel] *= 1.2
    elif kind == "hits":
        at = slice(3 * (channel // 3), 3 * (channel // 3) + 3)
        shift = np.exp(-2j * np.pi * frf.frequency * 2e-4)[:, None, None]
        values[:, at] = values[:, at] * (0.8 + 0.2 * 0.3 * shift)
    elif kind == "coordinates":
        coordinates = {name: at + 0.010 * rng.normal(size=3) for name, at in coordinates.items()}
        extra = "coordinate_deviation: 10 mm\n"
    elif kind == "masses":
        masses = {name: float(np.exp(0.1 * rng.normal())) for name in case.machine.description.bodies}
    elif kind == "scale":
        together = 0.15 * rng.normal()
        masses = {name: float(np.exp(together + 0.1 * rng.normal())) for name in case.machine.description.bodies}
        values *= np.exp(0.02 * rng.normal())
        extra = "calibration_deviation: 2 %\n"
    elif kind == "order":
        names = list(case.machine.description.bodies)
        order = {joint.child: joint.parent for joint in case.machine.description.joints.values()}
        i = int(rng.integers(1, len(names) - 1)) if len(names) > 2 else 1
        a, b = names[i], names[i + 1]
        swap = {a: b, b: a}
        order = {swap.get(child, child): swap.get(parent, parent) for child, parent in order.items()}
    return replace(frf, values=values), coordinates, masses, order, extra


def run_case(seed: int, kind: str, with_limits: bool, law: str = "coupled", count: int = 5, *,
             size: tuple[int, int] | None = None) -> dict:
    """Return what one machine gave; size : as in `joint_machines.random_case`."""
    case = jm.random_case(seed, law, size)
    rng = np.random.default_rng(10_000 + seed)
    clean = jm.responses(case, rng)
    frf, coordinates, masses, order, extra = spoilt(case, clean, rng, kind)
    deviation = {"masses": "10 %", "scale": "20 %"}.get(kind, "")
    row = {"seed": seed, "case": kind, "law": law, "joints": len(case.kinds), "noise": case.noise,
           "spoilt": next((str(dof) for k, dof in enumerate(frf.outputs)
                           if not np.array_equal(frf.values[:, k], clean.values[:, k])), "")}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        arguments = jm.write_test(case, frf, folder, points=coordinates, masses=masses, order=order, extra=extra,
                                  deviation=deviation)
        start = time.process_time()
        code, text = called([*arguments, "--machine", str(folder / "found.yaml"), "-o", str(folder / "page"), "--json"])
        row |= {"code": code, "cpu s": time.process_time() - start, "written": (folder / "found.yaml").exists()}
        shown = json.loads(text) if text.startswith("{") else {"joints": [], "doubts": [text[:500]], "missing": ""}
        row |= {"doubts": shown["doubts"], "missing": shown["missing"], "chosen": shown.get("damping"), **judged(case, shown)}
        if row["written"]:
            row["accepted"] = called(["check", str(folder / "found.yaml")])[0] == 0
        if row.get("accepted"):
            row |= asked(case, machine_file.read(folder / "found.yaml"), rng, with_limits, count)
    return row


def called(arguments: list[str]) -> tuple[int, str]:
    """Return (exit code, standard output) of a command."""
    out = io.StringIO()
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(io.StringIO()) as error:
            command(arguments)
        return 0, out.getvalue()
    except SystemExit as stopped:
        return int(stopped.code or 0), out.getvalue() or error.getvalue()


def judged(case, shown) -> dict:
    """Return which joints were found, and their errors: stiffness (worst over all motions), loss factor, scores of
    intervals."""
    found, stiffness, loss, scores, loss_scores = 0, [], [], [], []
    known = {joint["child"]: joint for joint in shown["joints"]}
    for joint in case.machine.description.joints.values():
        ways = tuple(joint.stiffness)
        basis = tf.adjoint(frame(joint.frame)) @ unit_twists(ways)
        other = known.get(joint.child)
        if other is None or other["parent"] != joint.parent or len(other["screws"]) != len(ways):
            continue
        screws = np.array(other["screws"]).T
        turn, *_ = np.linalg.lstsq(screws, basis, rcond=None)
        size = np.array([1, 1, 1, 1, 1, 1.0])[:, None]
        if np.abs(size * (screws @ turn - basis)).max() > 0.05:
            continue
        found += 1
        matrix = np.array(other["stiffness_matrix"]) if "stiffness_matrix" in other else np.diag(
            list(other.get("stiffness", {}).values()))
        if matrix.shape != turn.shape:
            continue
        values = np.array(list(joint.stiffness.values()))
        unit = turn.T @ matrix @ turn / np.sqrt(np.outer(values, values))
        stiffness.append(100 * float(np.abs(np.linalg.eigvalsh(unit) - 1).max()))
        if joint.loss_factor and other.get("loss_factor_interval"):
            loss.append(100 * abs(other["loss_factor"] / joint.loss_factor - 1))
            loss_scores.append((other["loss_factor"] - joint.loss_factor) / (other["loss_factor_interval"] / 1.959964))
        for i in range(len(ways)):
            if "stiffness_interval" not in other:
                continue
            near = int(np.argmax(np.abs(turn[:, i])))
            if abs(turn[near, i]) > 0.999 and np.abs(np.delete(turn[:, i], near)).max(initial=0) < 0.02:
                estimate, half = list(other["stiffness"].values())[near], list(other["stiffness_interval"].values())[near]
                scores.append((estimate - values[i]) / (half / 1.959964))
    return {"found": found, "stiffness %": stiffness, "loss %": loss, "stiffness scores": scores, "loss scores": loss_scores}


def asked(case, machine, rng, with_limits, count=5) -> dict:
    """Return frequencies, damping, receptances and limits at poses that nobody tested, beside the truth, with their scores."""
    poses = jm.random_poses(case, rng, count)
    spread = machine_uncertainty(machine)
    truth = [answer(case.machine, pose) for pose in poses]
    result = {"frequency %": [], "damping %": [], "receptance %": [], "frequency scores": [], "damping scores": [],
              "receptance scores": []}
    computed = np.array([answer(machine, pose) for pose in poses])
    if computed.shape != np.shape(truth):
        return {"frequency %": [100.0]}
    deviations = spread.spread(lambda m: np.array([answer(m, pose) for pose in poses])).deviation
    for mine, true, sd in zip(computed, truth, deviations, strict=True):
        n = (len(true) - 6) // 2
        result["frequency %"] += list(100 * np.abs(np.exp(mine[:n] - true[:n]) - 1))
        result["damping %"] += list(100 * np.abs(mine[n:2 * n] / true[n:2 * n] - 1))
        result["receptance %"] += list(100 * np.abs(np.exp(mine[2 * n:] - true[2 * n:]) - 1))
        score = (mine - true) / sd
        for name, part in (("frequency", slice(0, n)), ("damping", slice(n, 2 * n)), ("receptance", slice(2 * n, None))):
            result[f"{name} scores"] += list(score[part])
    if with_limits:
        result |= limits(case, machine, spread, poses, rng)
    return {name: [float(v) for v in values] for name, values in result.items()}


def answer(machine, pose) -> np.ndarray:
    """Return (ln frequencies, damping ratios, ln |receptance| of tool against table at six lines) at a pose."""
    system = assemble(machine, pose, ["tool-table:+x", "tool-table:+y"])
    poles = exact_poles(system)
    s = 2j * np.pi * np.array([15.0, 40.0, 90.0])
    stiffness = system.stiffness + 1j * (0 if system.structural_damping is None else system.structural_damping)
    damping = 0 if system.damping is None else system.damping
    g = [system.output_map @ np.linalg.solve(w**2 * system.mass + w * damping + stiffness, system.input_map) for w in s]
    lines = [np.log(abs(a[i, i])) for a in g for i in (0, 1)]
    return np.concatenate([np.log(np.abs(poles)), -poles.real / np.abs(poles), lines])


def exact_poles(system) -> np.ndarray:
    """Return the upper poles (n,) of s^2 M + s C + K + i D by size, rad/s, damping of both kinds taken whole."""
    n = system.size
    stiffness = system.stiffness + 1j * (0 if system.structural_damping is None else system.structural_damping)
    damping = np.zeros((n, n)) if system.damping is None else system.damping
    inverse = np.linalg.inv(system.mass)
    poles = np.linalg.eigvals(np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ stiffness, -inverse @ damping]]))
    upper = poles[np.argsort(poles.imag)[-n:]]
    return upper[np.argsort(np.abs(upper))]


def limits(case, machine, spread, poses, rng) -> dict:
    """Return depth limits (lowest over the speeds) and their scores from samples: by `lobes`, and by the full response."""
    true = np.array([direct_limit(case.machine, pose) for pose in poses])
    mine, direct = lowest(machine, poses), np.array([direct_limit(machine, pose) for pose in poses])
    drawn = np.array([lowest(sample, poses) for sample in spread.samples(SAMPLES, rng)])
    sd = np.maximum(np.log(drawn).std(axis=0, ddof=1), ENGINES)
    return {"limit %": 100 * (mine / true - 1), "limit scores": np.log(mine / true) / sd,
            "direct limit %": 100 * (direct / true - 1), "direct limit scores": np.log(direct / true) / sd}


def direct_limit(machine, pose) -> float:
    """Return the depth (m) stable at every speed by the full complex response and Hill's determinant."""
    description = machine.description
    labels = [f"{description.tool}-{description.table}:+{way}" for way in "xy"]
    if isinstance(description.modal_damping, tuple):
        frf = frequency_response.direct(assemble(machine, pose, labels), LINES)
    else:
        frf = jm.full_response(machine, LINES, labels, labels, pose)
    problem = milling_problem(description.cutting, frf, labels[0], y=labels[1])
    return float(np.min(deep_chart(problem, SPEEDS, HillDeterminant()).limit))


def lowest(machine, poses) -> np.ndarray:
    """Return the depth stable at every speed at each pose, m."""
    return np.array([float(np.min(chart.limit)) for chart in lobes(tool_point(machine, poses), speeds=SPEEDS)])


def summary(rows) -> dict:
    """Return the shares and percentiles over all machines."""
    def gathered(name):
        return np.array([v for row in rows for v in row.get(name, [])])

    def inside(name):
        z = np.abs(gathered(name))
        return float((z < 1.959964).mean()) if z.size else float("nan")

    joints = sum(row["joints"] for row in rows)
    whole = [row for row in rows if row["found"] == row["joints"]]
    silent = [row for row in rows if row["found"] < row["joints"] and not row["doubts"]]
    limit, score = gathered("limit %"), gathered("limit scores")
    # A pose without a limit below the chart, found and true, has nothing to compare.
    limit, score = limit[np.isfinite(limit)], score[np.isfinite(limit)]
    out = {"machines": len(rows), "all joints found": len(whole) / len(rows),
           "joints found": sum(r["found"] for r in rows) / joints,
           "false without a doubt": len(silent), "written": sum(r["written"] for r in rows),
           "accepted": sum(bool(r.get("accepted")) for r in rows), "doubted": sum(bool(r["doubts"]) for r in rows)}
    for name in ("stiffness %", "loss %", "frequency %", "damping %", "receptance %"):
        v = gathered(name)
        out |= {f"{name} median": float(np.median(v)), f"{name} 95th": float(np.quantile(v, 0.95)),
                f"{name} worst": float(v.max())} \
            if v.size else {}
    if limit.size:
        out |= {"limit within 10 %": float((np.abs(limit) <= 10).mean()), "limit % median": float(np.median(np.abs(limit))),
                "limit unsafe beyond its interval": float((score > STUDENT).mean()),
                "limit intervals hold": float((np.abs(score) < STUDENT).mean())}
        direct, score = gathered("direct limit %"), gathered("direct limit scores")
        direct, score = direct[np.isfinite(direct)], score[np.isfinite(direct)]
        out |= {"direct limit % median": float(np.median(np.abs(direct))),
                "direct limit % worst": float(np.abs(direct).max()),
                "direct limit unsafe beyond its interval": float((score > STUDENT).mean()),
                "direct limit intervals hold": float((np.abs(score) < STUDENT).mean())}
    for name in ("stiffness", "loss", "frequency", "damping", "receptance"):
        out[f"{name} intervals hold"] = inside(f"{name} scores")
    out["cpu s median"] = float(np.median([row["cpu s"] for row in rows]))
    out["cpu s worst"] = max(row["cpu s"] for row in rows)
    return out


def found_out(rows) -> float:
    """Return the share of machines whose fault is named, or whose stiffnesses all lie within their intervals (factor 1.5)."""
    good = [row for row in rows if row["doubts"] or (
        row["found"] == row["joints"] and (np.abs(row["stiffness scores"]) < 3.0).all())]
    return len(good) / len(rows)


def main() -> None:
    """Run, print each machine and the summary, then the figure."""
    parser = CommandLine(__doc__)
    parser.seed(0, "first")
    parser.cases("seeds", 200)
    parser.part("case", default="plain", choices=CASES)
    parser.add_argument("--results", type=Path)
    parser.add_argument("--without-limits", action="store_true")
    parser.add_argument("--laws", action="store_true")
    parser.add_argument("--poses", type=int, default=5)
    parser.add_argument("--size", type=int, nargs=2, metavar=("BODIES", "POINTS"),
                        help="of every machine; random where left out")
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    rows = read_rows(given.results)
    done = {row["seed"] for row in rows}
    for seed in range(given.first, given.first + given.seeds):
        if seed in done:
            continue
        law = jm.law_of(seed) if given.laws else "coupled"
        row = run_case(seed, given.case, not given.without_limits, law, given.poses,
                       size=None if given.size is None else tuple(given.size))
        rows.append(row)
        chosen = (row["chosen"] or {}).get("law", "") if given.laws else ""
        print(f"{seed} {law} {chosen}: {row['found']} of {row['joints']}, code {row['code']}, {row['cpu s']:.1f} s"
              f"{'' if row['found'] == row['joints'] and not row['doubts'] else ' ' + ' | '.join(row['doubts'])[:300]}"
              f"{row['missing'][:200]}", flush=True)
        if given.results is not None:
            with given.results.open("a") as file:
                file.write(json.dumps(row) + "\n")
    for law in jm.LAWS if given.laws else ():
        if part := [row for row in rows if row["law"] == law]:
            print(f"{law}:")
            for name, value in summary(part).items():
                print(f"    {name:42s}{value:.4g}")
    for name, value in summary(rows).items():
        print(f"    {name:42s}{value:.4g}")
    if given.case != "plain":
        named = np.mean([any(doubt.removeprefix("channel ").startswith(f"{row['spoilt']}:") for doubt in row["doubts"])
                         for row in rows])
        print(f"    found out or inside {found_out(rows):.4g}, the one channel by name {named:.4g}")
    s = summary(rows)
    print(f"{given.case}: all joints found in {100 * s['all joints found']:.1f} % of {s['machines']} machines, stiffness 95th "
          f"percentile {s.get('stiffness % 95th', float('nan')):.3g} %, damping {s.get('loss % 95th', float('nan')):.3g} %, "
          f"{s['false without a doubt']} false without a doubt")


if __name__ == "__main__":
    sys.exit(main())
