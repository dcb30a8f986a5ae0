"""Random servo, component, cut and datasheet files with one slip each, through the reader and `check`: is it told by name.

True files: servos of one to three axes (rigid or two masses), drawn over what small and large machines have; the template of
components, scaled and its masses drawn; cuts of random tools and materials; the shipped robot's datasheet with its lengths,
reducers, dampers and weights multiplied. Slips are of unit, sign, exchange and omission. A slip is told where a fault or doubt
names the number (or, for exchanged ones, one of the two).
"""

from __future__ import annotations

import copy
import re
import sys
import tempfile
import warnings
from collections import Counter, defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np
import yaml

from benchmarks.frame import MACHINE_TEMPLATES, CommandLine
from toolpoint import io, studies
from toolpoint._check import ToolpointError
from toolpoint._doubt import Doubt
from toolpoint.io.template_files import read_template

SHEET = MACHINE_TEMPLATES / "milling_robot_datasheet.yaml"
NUMBER = re.compile(r"[-+]?\d*\.?\d+(?:[eE][-+]?\d+)?")
Data = dict[str, Any]


def times(value: Any, factor: float) -> Any:
    """Return a value, with its unit where it has one, multiplied."""
    if isinstance(value, list):
        return [times(v, factor) for v in value]
    if isinstance(value, str):
        return NUMBER.sub(lambda match: f"{float(match.group()) * factor:.6g}", value, count=0)
    return float(f"{float(value) * factor:.9g}")


def loaded(text: str) -> Data:
    """Return the data of a YAML text whose exponents have no sign."""
    return yaml.safe_load(re.sub(r"(?<![\w.])(\d+(?:\.\d+)?)e(\d)", lambda m: f"{float(m[1])}e+{m[2]}", text))


def random_servo(rng: np.random.Generator) -> Data:
    """A servo of one to three axes."""
    axes = {}
    size, lead, period = float(10 ** rng.uniform(-1, 1)), float(rng.choice([5, 10, 12, 16, 20])), float(rng.choice([0.5, 1, 2]))
    for name in "XYZ"[:int(rng.integers(1, 4))]:
        inertia = 0.008 * size * float(rng.uniform(0.5, 2))
        coulomb = 2.0 * size**0.7 * float(rng.uniform(0.5, 1.6))
        band, gain = float(rng.uniform(80, 400)), float(rng.uniform(20, 90))
        mechanics = {"kind": "rigid", "inertia": f"{inertia:.4g} kg*m^2", "lead": f"{lead:g} mm"}
        if rng.random() < 0.4:
            mechanics |= {"kind": "two-mass", "table_mass": f"{200 * size * rng.uniform(0.5, 2):.4g} kg",
                          "stiffness": f"{rng.uniform(50, 300):.4g} N/um", "damping": "5000 N*s/m"}
        axes[name] = {"mechanics": mechanics,
                      "friction": {"law": "lugre", "coulomb": f"{coulomb:.4g} N*m",
                                   "static": f"{coulomb * rng.uniform(1.1, 1.7):.4g} N*m",
                                   "stribeck_velocity": f"{rng.uniform(0.1, 3):.4g} rad/s",
                                   "viscous": f"{coulomb * rng.uniform(2e-3, 2e-2):.4g} N*m*s/rad",
                                   "bristle_stiffness": f"{coulomb * 10 ** rng.uniform(2.5, 4):.4g} N*m/rad",
                                   "bristle_damping": f"{coulomb * rng.uniform(0.5, 3):.4g} N*m*s/rad"},
                      "position": {"gain": f"{gain:.4g} 1/s", "sample_time": f"{period:g} ms"},
                      "velocity": {"gain": f"{band * inertia:.4g} N*m*s/rad", "integral_time": f"{rng.uniform(5, 80):.3g} ms",
                                   "sample_time": "0.25 ms"}}
    return {"toolpoint": 1, "name": "servo", "axes": axes, "limits": {
        "speed": f"{rng.uniform(8, 60):.3g} m/min", "acceleration": f"{rng.uniform(0.5, 10):.3g} m/s^2",
        "jerk": f"{10 ** rng.uniform(1, 2.5):.3g} m/s^3"}}


def random_components(rng: np.random.Generator) -> Data:
    """The template of components, scaled."""
    data = loaded(read_template("components", ""))
    scale = float(rng.uniform(0.5, 2.0))
    for part in data["components"].values():
        body = part["body"]
        body["mass"] = times(body["mass"], scale**3 * float(rng.uniform(0.6, 1.5)))
        body["centre"], body["shape"]["size"] = times(body["centre"], scale), times(body["shape"]["size"], scale)
    for point in data["points"].values():
        point["at"] = times(point["at"], scale)
    data["axes"]["X"]["limits"] = times(data["axes"]["X"]["limits"], scale * float(rng.uniform(0.6, 1.6)))
    return data


def random_cut(rng: np.random.Generator) -> Data:
    """A section of a cut."""
    diameter, tangential = float(10 ** rng.uniform(0.4, 2.0)), float(10 ** rng.uniform(2.7, 3.5))
    speed = float(np.clip(1000 * 10 ** rng.uniform(1.7, 2.8) / (np.pi * diameter), 100, 50000))
    cut = {"diameter": f"{diameter:.3g} mm", "teeth": int(rng.integers(1, 8)), "helix": f"{rng.uniform(10, 45):.3g} deg",
           "tangential": f"{tangential:.4g} MPa", "normal": f"{tangential * rng.uniform(0.15, 0.7):.4g} MPa",
           "edge_tangential": f"{rng.uniform(5, 40):.3g} N/mm", "edge_normal": f"{rng.uniform(5, 40):.3g} N/mm",
           "immersion": float(f"{rng.uniform(0.1, 1):.3g}"), "direction": str(rng.choice(["up", "down"])),
           "feed_per_tooth": f"{diameter * rng.uniform(0.002, 0.02):.3g} mm",
           "flute_length": f"{diameter * rng.uniform(1, 4):.3g} mm",
           "speeds": f"{speed / 3:.4g}, {speed:.4g} rpm"}
    return {"cutting": cut}


def random_sheet(rng: np.random.Generator) -> Data:
    """The shipped datasheet, its lengths, reducers, dampers and weight multiplied."""
    data = loaded(SHEET.read_text(encoding="utf-8"))
    scale, power = float(rng.uniform(0.7, 1.6)), float(rng.uniform(0.5, 2.5))
    for axis in data["axes"]:
        for key in ("a", "d"):
            if key in axis:
                axis[key] = times(axis[key], scale)
    for row in data["catalogue"].values():
        row["torsion"] = times(row["torsion"], power * float(rng.uniform(0.7, 1.4)))
        row["bending"] = times(row["bending"], power * float(rng.uniform(0.7, 1.4)))
        row["damping"] = times(row["damping"], power * float(rng.uniform(0.5, 1.5)))
    data.pop("cutting", None)
    for key in ("reach", "stillness", "power_off"):
        data.pop(key, None)
    return data


def whole_catalogue(key: str, factor: float) -> Callable[[Data, np.random.Generator], str | None]:
    """A slip: one number of every reducer in another unit, so that only the robot as a whole contradicts it."""
    def slip(data: Data, rng: np.random.Generator) -> str | None:
        del rng
        for row in data["catalogue"].values():
            row[key] = times(row[key], factor)
        return "catalogue|first frequency|damping of the first mode"
    return slip


def number(path: str, factor: float) -> Callable[[Data, np.random.Generator], str | None]:
    """A slip: the number at a path (with * for any part) multiplied; it is named by its path."""
    def slip(data: Data, rng: np.random.Generator) -> str | None:
        place, key, words = locate(data, path, rng)
        if place is None or key not in place:
            return None
        if float(NUMBER.search(str(place[key])).group()) == 0:
            return None
        place[key] = times(place[key], factor)
        return ".".join(words)
    return slip


def locate(data: Data, path: str, rng: np.random.Generator) -> tuple[Any, Any, list[str]]:
    """Return the part that holds the number at a path, its key, and the path as messages write it."""
    place: Any = data
    words: list[str] = []
    *parts, last = path.split(".")
    for part in parts:
        if part == "*":
            keys = list(range(len(place))) if isinstance(place, list) else list(place)
            keys = [key for key in keys if not isinstance(place[key], dict) or last in place[key] or len(parts) > 2]
            if not keys:
                return None, None, words
            key = keys[int(rng.integers(len(keys)))]
        else:
            key = part
        if isinstance(place, dict) and key not in place:
            return None, None, words
        place = place[key]
        words.append(str(place["name"]) if isinstance(key, int) else str(key))
    return place, last, [*words, last]


def exchanged(first: str, second: str) -> Callable[[Data, np.random.Generator], str | None]:
    """A slip: two numbers exchanged (``*`` of the first stands for the same part in the second)."""
    def slip(data: Data, rng: np.random.Generator) -> str | None:
        place, key, words = locate(data, first, rng)
        if place is None or key not in place:
            return None
        other_path = second
        for part, word in zip(first.split("."), words, strict=True):
            if part == "*":
                other_path = other_path.replace("*", word, 1)
        other, other_key, other_words = locate(data, other_path, rng)
        if other is None or other_key not in other:
            return None
        one_text, two_text = str(place[key]), str(other[other_key])
        one, two = NUMBER.search(one_text).group(), NUMBER.search(two_text).group()
        place[key], other[other_key] = NUMBER.sub(two, one_text, count=1), NUMBER.sub(one, two_text, count=1)
        return ".".join(words) + "|" + ".".join(other_words)
    return slip


def all_angles(data: Data, rng: np.random.Generator) -> str | None:
    """All angles of the table in radians, read as degrees."""
    del rng
    for axis in data["axes"]:
        for key in ("alpha", "theta"):
            if key in axis:
                axis[key] = f"{np.radians(float(NUMBER.search(axis[key]).group())):.6g} deg"
    return "axes"


def all_angles_bare(data: Data, rng: np.random.Generator) -> str | None:
    """All angles of the table in degrees, their unit left out, so that they are read as rad."""
    del rng
    for axis in data["axes"]:
        for key in ("alpha", "theta"):
            if key in axis:
                axis[key] = float(NUMBER.search(axis[key]).group())
    return "axes|theta|alpha"


def omitted(path: str) -> Callable[[Data, np.random.Generator], str | None]:
    """A slip: a key left out."""
    def slip(data: Data, rng: np.random.Generator) -> str | None:
        place, key, words = locate(data, path, rng)
        if place is None or key not in place:
            return None
        place.pop(key)
        return ".".join(words) + "|" + key
    return slip


def negative(path: str) -> Callable[[Data, np.random.Generator], str | None]:
    """A slip: a number with the other sign."""
    return number(path, -1.0)


FILES: dict[str, Callable[[np.random.Generator], Data]] = {
    "servo": random_servo, "components": random_components, "cut": random_cut, "datasheet": random_sheet}
_AXIS = "axes.*."
SLIPS: dict[str, dict[str, Any]] = {
    "servo": {
        **{f"{key} x {f:g}": number(_AXIS + key, f) for key in (
            "mechanics.inertia", "mechanics.lead", "velocity.gain", "velocity.integral_time", "position.sample_time",
            "velocity.sample_time", "friction.coulomb", "friction.static", "friction.bristle_stiffness",
            "mechanics.table_mass", "mechanics.stiffness") for f in (1e-3, 1e3)},
        **{f"position.gain x {f:g}": number("axes.*.position.gain", f) for f in (1e-3, 1 / 60, 60, 1e3)},
        "stribeck x 1000": number("axes.*.friction.stribeck_velocity", 1e3),
        "viscous x 1000": number("axes.*.friction.viscous", 1e3),
        **{f"limits.{key} x {f:g}": number(f"limits.{key}", f)
           for key in ("speed", "acceleration", "jerk") for f in (1e-3, 1e3)},
        "gains exchanged": exchanged("axes.*.position.gain", "axes.*.velocity.gain"),
        "friction exchanged": exchanged("axes.*.friction.coulomb", "axes.*.friction.static"),
        "no gain": omitted("axes.*.velocity.gain"), "no lead": omitted("axes.*.mechanics.lead"),
        "no inertia": omitted("axes.*.mechanics.inertia"), "negative gain": negative("axes.*.position.gain"),
        "negative inertia": negative("axes.*.mechanics.inertia")},
    "components": {
        **{f"mass x {f:g}": number("components.*.body.mass", f) for f in (1e-3, 1e3)},
        **{f"size x {f:g}": number("components.*.body.shape.size", f) for f in (1e-3, 1e3)},
        "centre x 1000": number("components.*.body.centre", 1e3), "point x 1000": number("points.*.at", 1e3),
        **{f"limits x {f:g}": number("axes.*.limits", f) for f in (1e-3, 1e3)},
        "mass deviation 5": number("components.*.uncertainty.mass", 100), "centre deviation x 1000": number(
            "components.*.uncertainty.centre", 1e3), "coordinates x 1000": number("coordinate_deviation", 1e3),
        "calibration x 100": number("calibration_deviation", 100), "negative mass": negative("components.*.body.mass"),
        "no points": omitted("components.*.points"), "no mover": omitted("axes.*.moves")},
    "cut": {
        **{f"{key} x {f:g}": number("cutting." + key, f) for key in (
            "diameter", "tangential", "normal", "edge_tangential", "flute_length", "speeds") for f in (1e-3, 1e3)},
        "feed x 1000": number("cutting.feed_per_tooth", 1e3), "feed x 0.001": number("cutting.feed_per_tooth", 1e-3),
        "helix in rad": number("cutting.helix", np.pi / 180), "helix x 57": number("cutting.helix", 180 / np.pi),
        "immersion x 100": number("cutting.immersion", 100), "negative normal": negative("cutting.normal"),
        "no diameter": omitted("cutting.diameter"), "no teeth": omitted("cutting.teeth"),
        "no tangential": omitted("cutting.tangential")},
    "datasheet": {
        "all angles rad for deg": all_angles, "all angles deg for rad": all_angles_bare,
        **{f"{key} x {f:g}": number("catalogue.*." + key, f) for key in ("bending", "torsion", "damping") for f in (1e-3, 1e3)},
        **{f"all {key} x {f:g}": whole_catalogue(key, f) for key in ("torsion", "damping") for f in (1e-3, 1e3)},
        **{f"{key} x {f:g}": number(key, f) for key in ("weight", "payload.mass") for f in (1e-3, 1e3)},
        "a x 1000": number("axes.*.a", 1e3), "d x 1000": number("axes.*.d", 1e3),
        "an angle in rad": number("axes.*.alpha", np.pi / 180), "no motor": omitted("axes.*.motor"),
        "no weight": omitted("weight"), "negative torsion": negative("catalogue.*.torsion")},
}


def told(data: Data, path: Path) -> list[str]:
    """Return the lines that the reader or `check` says of a file."""
    path.write_text(yaml.safe_dump(data, sort_keys=False))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return list(studies.question_part(io.read_kind(path, io.kind_of(path))[1]))
    except ToolpointError as error:
        return str(error).splitlines()


def names(line: str, part: str) -> bool:
    """Return whether a line is about a number: a doubt begins with it or what holds it alone; a fault has its last words."""
    if isinstance(line, Doubt):
        return line.what == part or line.what.startswith(part + ".") or part.startswith(line.what + ".")
    return part.split(".")[-1] in line or ("." in part and part.rsplit(".", 1)[0] + ":" in line)


def main() -> int:
    """Print the share told by kind, the share of true files doubted, and what was missed."""
    parser = CommandLine(__doc__)
    parser.cases("files", 200, "true ones, of all kinds together")
    parser.add_argument("--slips", type=int, default=6, help="of every file")
    parser.seed(0, "first-seed")
    asked = parser.parse_args()
    counts, hits, doubted = Counter[str](), Counter[str](), Counter[str]()
    examples = defaultdict[str, list[str]](list)
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(asked.first_seed, asked.first_seed + asked.files):
            rng, kind = np.random.default_rng(seed), list(FILES)[seed % len(FILES)]
            data, path = FILES[kind](rng), Path(folder) / f"{kind}.yaml"
            before = set(told(data, path))
            if before:
                doubted[kind] += 1
                print(f"true file {seed} ({kind}): {next(iter(before))}", flush=True)
            done = 0
            for name in sorted(SLIPS[kind], key=lambda name: (counts[f"{kind}: {name}"], rng.random())):
                changed, label = copy.deepcopy(data), f"{kind}: {name}"
                part = SLIPS[kind][name](changed, rng) if done < asked.slips else None
                if part is None:
                    continue
                done += 1
                counts[label] += 1
                more = [line for line in told(changed, path) if line not in before]
                if any(names(line, word) for line in more for word in part.split("|")):
                    hits[label] += 1
                else:
                    examples[label].append(f"{seed} {part}: {more[:1]}")
    for label in sorted(counts, key=lambda k: hits[k] / counts[k]):
        if hits[label] < counts[label]:
            print(f"{label}: {hits[label]} of {counts[label]} told; {examples[label][0]}")
    for kind in FILES:
        labels = [label for label in counts if label.startswith(f"{kind}: ")]
        print(f"{kind}: {len(labels)} kinds, {sum(hits[k] for k in labels)} of {sum(counts[k] for k in labels)} told; true "
              f"files doubted: {doubted[kind]}")
    total = max(sum(counts.values()), 1)
    print(f"{len(counts)} kinds: {100 * sum(hits.values()) / total:.1f} % of {total} told by name; true files doubted: "
          f"{sum(doubted.values())} of {asked.files}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
