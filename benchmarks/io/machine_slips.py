"""Random machine files with one slip each, through the reader and `check`: is the slip told under the right name.

True machines: the templates with every mass, stiffness and travel multiplied at random (0.6 to 1.7) and one scale of size
(0.7 to 1.5); a third of those with guides by catalogue carry a guideway and a ball screw, robots carry dampers. Slips are of
unit, sign, place, exchange and omission. A slip is told where a fault or a doubt names the part that was changed.
"""

from __future__ import annotations

import copy
import math
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

from benchmarks.frame import CommandLine
from toolpoint import io, studies
from toolpoint._check import ToolpointError
from toolpoint._doubt import Doubt
from toolpoint.io.template_files import read_template

TEMPLATES = ("three-axis-vertical", "three-axis-horizontal", "boring-mill", "trunnion", "gantry", "lathe", "grinder", "robot")
NUMBER = re.compile(r"[-+]?\d*\.?\d+(?:[eE][-+]?\d+)?")
SOLID = 7900.0  # kg/m^3, steel: no body is denser
Data = dict[str, Any]
Slip = Callable[[Data, np.random.Generator], str | None]


def value_of(value: Any) -> float:
    """Return the first number of a value as it is written, its unit left."""
    return float(value) if isinstance(value, (int, float)) else float(NUMBER.search(str(value)).group())


def times(value: Any, factor: float) -> Any:
    """Return a value, with its unit where it has one, multiplied."""
    if isinstance(value, list):
        return [times(v, factor) for v in value]
    if isinstance(value, str):
        return NUMBER.sub(lambda found: f"{float(found.group()) * factor:.6g}", value)
    return float(f"{float(value) * factor:.9g}")


def random_machine(name: str, rng: np.random.Generator) -> Data:
    """Return a true machine of a template, as the data of its file."""
    text = re.sub(r"(?<![\w.])(\d+)e(\d)", r"\1.0e\2", read_template("machine", name))  # YAML 1.1 wants 1.0e+9 for a number
    data: Data = yaml.safe_load(re.sub(r"(?<![\w.])(\d+\.\d+)e(\d)", r"\1e+\2", text))
    scale = float(rng.uniform(0.7, 1.5))
    for body in data["bodies"].values():
        body["mass"] = times(body["mass"], scale**3 * float(rng.uniform(0.7, 1.4)))
        body["centre"] = times(body["centre"], scale)
        for key in ("size", "diameter", "length"):
            if key in body.get("shape", {}):
                body["shape"][key] = times(body["shape"][key], scale)
        if (density := _density(body)) > SOLID:
            body["mass"] = times(body["mass"], SOLID / density)
    for joint in data["joints"].values():
        joint["at"] = times(joint["at"], scale)
        for way, value in joint.get("stiffness", {}).items():
            joint["stiffness"][way] = times(value, scale ** (3 if "r" in way else 1) * float(rng.uniform(0.6, 1.7)))
        if name == "robot" and joint.get("stiffness"):
            joint["damping"] = {way: float(f"{value * rng.uniform(3e-4, 1e-3):.4g}")
                                for way, value in joint["stiffness"].items()}
    for point in data["points"].values():
        point["at"] = times(point["at"], scale)
    for axis in data["axes"].values():
        if "mm" in str(axis["limits"]) or " m" in str(axis["limits"]):
            axis["limits"] = times(axis["limits"], scale)
    data.pop("poses", None)
    if "guide_x" in data["joints"] and name != "robot" and rng.random() < 0.5:
        joint, along = data["joints"]["guide_x"], str(data["axes"]["X"]["direction"]).lstrip("-")
        low, high = (float(v) for v in NUMBER.findall(str(data["axes"]["X"]["limits"])))
        unit = 1e-3 if "mm" in str(data["axes"]["X"]["limits"]) else 1.0
        reach = float(rng.uniform(0.15, 0.3))
        length = (high - low) * unit + float(rng.uniform(0.3, 0.5))
        sides = [(a, b) for a in (-reach, reach) for b in (-reach, reach)]
        across = {"x": lambda a, b: [a, b, 0.0], "y": lambda a, b: [b, a, 0.0], "z": lambda a, b: [0.0, b, a]}[along]
        joint.pop("stiffness")
        joint["law"] = {
            "guideway": {"at": [across(a, b) for a, b in sides], "along": along, "up": "z" if along != "z" else "x",
                         "radial": f"{rng.uniform(300, 900):.4g} N/um", "lateral": f"{rng.uniform(300, 900):.4g} N/um"},
            "ball_screw": {"nut": f"{rng.uniform(400, 900):.4g} N/um", "bearing": f"{rng.uniform(500, 900):.4g} N/um",
                           "diameter": f"{rng.uniform(25, 50):.3g} mm", "length": f"{1e3 * length:.5g} mm",
                           "nut_at": f"{1e3 * (length - (high + low) * unit) / 2:.5g} mm", "along": along}}
        joint["law"]["ball_screw"]["follows"] = "away"
    return data


def _pick(rng: np.random.Generator, items: list[Any]) -> Any:
    return items[int(rng.integers(len(items)))] if items else None


def stiffness_slip(factor: float, turns: bool, place: str) -> Slip:
    """One stiffness of a joint (`place`: feet or any) multiplied."""
    def slip(data: Data, rng: np.random.Generator) -> str | None:
        rows = [(name, way) for name, joint in data["joints"].items() for way in joint.get("stiffness", {})
                if ("r" in way) == turns and (place == "any" or joint["parent"] == "ground") and len(joint["stiffness"]) > 2]
        if not rows:
            return None
        name, way = _pick(rng, rows)
        row = data["joints"][name]["stiffness"]
        row[way] = times(row[way], factor)
        return f"joints.{name}"
    return slip


def _own_turn(data: Data, name: str, way: str) -> bool:
    """Return whether a turn is driven, or about a round body's own axis: from a free bearing to a clamp, all is valid."""
    joint = data["joints"][name]
    bodies = [data["bodies"][body]["shape"] for body in (joint["parent"], joint["child"]) if body in data["bodies"]]
    driven = [drive for axis in data["axes"].values() for drive in axis.get("drives", [axis])]
    return (any(shape["kind"] == "cylinder" and way == "r" + shape["axis"] for shape in bodies)
            or any(drive["joint"] == name and drive["direction"].lstrip("-") == way for drive in driven))


def turn_slip(factor: float, own: bool) -> Slip:
    """One turning stiffness multiplied: one of several of a kind, or that about a body's own or a driven axis."""
    def slip(data: Data, rng: np.random.Generator) -> str | None:
        rows = [(name, way) for name, joint in data["joints"].items() for way in joint.get("stiffness", {})
                if "r" in way and len(joint["stiffness"]) > 2 and _own_turn(data, name, way) == own]
        if not rows:
            return None
        name, way = _pick(rng, rows)
        data["joints"][name]["stiffness"][way] = times(data["joints"][name]["stiffness"][way], factor)
        return f"joints.{name}"
    return slip


def joint_slip(factor: float, key: str) -> Slip:
    """All stiffness or damping of one joint multiplied."""
    def slip(data: Data, rng: np.random.Generator) -> str | None:
        names = [name for name, joint in data["joints"].items() if joint.get(key)]
        if not names:
            return None
        name = _pick(rng, names)
        data["joints"][name][key] = {way: times(value, factor) for way, value in data["joints"][name][key].items()}
        return f"joints.{name}"
    return slip


def damper_slip(factor: float) -> Slip:
    """One damper multiplied."""
    def slip(data: Data, rng: np.random.Generator) -> str | None:
        rows = [(n, w) for n, joint in data["joints"].items() for w in joint.get("damping", {})]
        if not rows:
            return None
        name, way = _pick(rng, rows)
        data["joints"][name]["damping"][way] *= factor
        return f"joints.{name}.damping"
    return slip


def body_slip(key: str, factor: float) -> Slip:
    """Mass, centre or a size of a body multiplied."""
    def slip(data: Data, rng: np.random.Generator) -> str | None:
        names = [n for n, b in data["bodies"].items() if (key in b or key in b.get("shape", {}))
                 and (key != "centre" or max(abs(v) for v in b["centre"]) > 0.05)]
        if not names:
            return None
        name = _pick(rng, names)
        part = data["bodies"][name] if key in data["bodies"][name] else data["bodies"][name]["shape"]
        part[key] = times(part[key], factor)
        return f"bodies.{name}"
    return slip


def _density(body: Data) -> float:
    """Density of a body's box or cylinder, kg/m^3."""
    shape = body["shape"]
    if shape["kind"] == "box":
        return value_of(body["mass"]) / float(np.prod(shape["size"]))
    diameter, length = (value_of(shape[key]) * (1e-3 if "mm" in str(shape[key]) else 1.0) for key in ("diameter", "length"))
    return value_of(body["mass"]) / (math.pi / 4 * diameter**2 * length)


def pounds_slip(data: Data, rng: np.random.Generator) -> str | None:
    """The mass of a nearly solid body in pounds, typed as kg; how hollow a casting is, no file says."""
    names = [n for n, body in data["bodies"].items() if _density(body) > 5000]
    if not names:
        return None
    name = _pick(rng, names)
    data["bodies"][name]["mass"] = times(data["bodies"][name]["mass"], 2.2046)
    return f"bodies.{name}"


def density_slip(value: float) -> Slip:
    """A density in g/cm^3 (or 1000 times too large) for one in kg/m^3, in place of a mass."""
    def slip(data: Data, rng: np.random.Generator) -> str | None:
        name = _pick(rng, list(data["bodies"]))
        data["bodies"][name].pop("mass")
        data["bodies"][name]["density"] = value
        return f"bodies.{name}"
    return slip


def place_slip(room: str, factor: float) -> Slip:
    """The place of a joint or a point multiplied."""
    def slip(data: Data, rng: np.random.Generator) -> str | None:
        names = [n for n, part in data[room].items() if max(abs(v) for v in part["at"]) > 0.05
                 and (room == "points" or part.get("stiffness"))]
        if not names:
            return None
        name = _pick(rng, names)
        data[room][name]["at"] = times(data[room][name]["at"], factor)
        return f"{room}.{name}"
    return slip


def raised_slip(height: float) -> Slip:
    """The tip typed metres above the machine."""
    def slip(data: Data, rng: np.random.Generator) -> str | None:
        del rng
        data["points"][data["tool"]]["at"][2] += height
        return f"points.{data['tool']}"
    return slip


def sign_slip(turns: bool) -> Slip:
    """The direction of one axis with the other sign."""
    def slip(data: Data, rng: np.random.Generator) -> str | None:
        names = [n for n, a in data["axes"].items() if n in "XYZABC" and "direction" in a and ("r" in a["direction"]) == turns]
        if not names:
            return None
        axis = data["axes"][name := _pick(rng, names)]
        axis["direction"] = axis["direction"][1:] if axis["direction"][0] == "-" else "-" + axis["direction"]
        return f"axes.{name}"
    return slip


def way_slip(data: Data, rng: np.random.Generator) -> str | None:
    """An axis along another direction than its name."""
    names = [n for n, a in data["axes"].items() if n in "XYZ" and "direction" in a]
    if not names:
        return None
    axis = data["axes"][name := _pick(rng, names)]
    old = axis["direction"].lstrip("-")
    axis["direction"] = _pick(rng, [w for w in "xyz" if w != old])
    return f"axes.{name}"


def exchanged_axes(data: Data, rng: np.random.Generator) -> str | None:
    """Two axes with each other's joints."""
    names = [n for n, a in data["axes"].items() if n in "XYZ" and "direction" in a]
    if len(names) < 2:
        return None
    first, second = (str(n) for n in rng.permutation(names)[:2])
    data["axes"][first], data["axes"][second] = data["axes"][second], data["axes"][first]
    return "axes."


def limits_slip(factor: float) -> Slip:
    """The travel of a linear axis in another unit."""
    def slip(data: Data, rng: np.random.Generator) -> str | None:
        names = [n for n, a in data["axes"].items() if "mm" in str(a["limits"]) or " m" in str(a["limits"])]
        if not names:
            return None
        axis = data["axes"][name := _pick(rng, names)]
        axis["limits"] = times(axis["limits"], factor)
        return f"axes.{name}"
    return slip


def reversed_joint(data: Data, rng: np.random.Generator) -> str | None:
    """Parent and child exchanged."""
    names = [n for n, j in data["joints"].items() if not j.get("closes_loop")]
    joint = data["joints"][name := _pick(rng, names)]
    joint["parent"], joint["child"] = joint["child"], joint["parent"]
    return f"joint {name}"


def omitted(room: str, key: str) -> Slip:
    """A key left out of a body, joint, axis or the whole file."""
    def slip(data: Data, rng: np.random.Generator) -> str | None:
        if not room:
            return data.pop(key, None) and key
        names = [n for n, part in data[room].items() if key in part and (key != "at" or part.get("stiffness"))]
        if not names:
            return None
        data[room][name := _pick(rng, names)].pop(key)
        return name
    return slip


def tool_left_out(data: Data, rng: np.random.Generator) -> str | None:
    """A cut without its tool."""
    del rng
    data.pop("tool")
    return "cutting" if "cutting" in data else None


def law_slip(part: str, key: str, factor: float) -> Slip:
    """A number of a guideway or ball screw multiplied."""
    def slip(data: Data, rng: np.random.Generator) -> str | None:
        del rng
        for name, joint in data["joints"].items():
            if "law" in joint:
                joint["law"][part][key] = times(joint["law"][part][key], factor)
                return "axes.X|joints." + name if key in ("length", "nut_at") else f"joints.{name}"
        return None
    return slip


def screw_still(data: Data, rng: np.random.Generator) -> str | None:
    """A screw that does not follow its axis."""
    del rng
    for name, joint in data["joints"].items():
        if "law" in joint:
            joint["law"]["ball_screw"].pop("follows")
            return f"joints.{name}"
    return None


def carriages_slip(data: Data, rng: np.random.Generator) -> str | None:
    """Carriages in machine coordinates."""
    del rng
    for name, joint in data["joints"].items():
        if "law" in joint and math.hypot(*joint["at"]) > 0.7:
            guide = joint["law"]["guideway"]
            guide["at"] = [[float(a + b) for a, b in zip(place, joint["at"], strict=True)] for place in guide["at"]]
            return f"joints.{name}"
    return None


def typed(key: str, value: Any) -> Slip:
    """A number of the whole file typed otherwise."""
    def slip(data: Data, rng: np.random.Generator) -> str | None:
        del rng
        if key not in data:
            return None
        data[key] = value
        return key
    return slip


def cut_slip(key: str, value: Any) -> Slip:
    """A number of the cut typed otherwise."""
    def slip(data: Data, rng: np.random.Generator) -> str | None:
        del rng
        if "cutting" not in data:
            return None
        data["cutting"][key] = value
        return "cutting"
    return slip


def angle_slip(value: float) -> Slip:
    """A joint turned by 90 degrees, typed in the other unit."""
    def slip(data: Data, rng: np.random.Generator) -> str | None:
        name = _pick(rng, [n for n, j in data["joints"].items() if j.get("stiffness") and "rotation" not in j])
        data["joints"][name]["rotation"] = [0, 0, value]
        return f"joints.{name}"
    return slip


SLIPS: dict[str, Slip] = {
    **{f"a stiffness along x {f:g}": stiffness_slip(f, False, "any") for f in (1e-6, 1e-3, 1e3, 1e6)},
    **{f"a stiffness about x {f:g}": stiffness_slip(f, True, "any") for f in (1e-6, 1e-3, 1e3, 1e6)},
    **{f"a stiffness of the feet x {f:g}": stiffness_slip(f, False, "feet") for f in (1e-3, 1e3)},
    **{f"a turning stiffness of the feet x {f:g}": stiffness_slip(f, True, "feet") for f in (1e-3, 1e3)},
    **{f"all stiffness of a joint x {f:g}": joint_slip(f, "stiffness") for f in (1e-6, 1e-3, 1e3, 1e6)},
    **{f"all damping of a joint x {f:g}": joint_slip(f, "damping") for f in (1e-6, 1e-3, 1e3, 1e6)},
    **{f"a damper x {f:g}": damper_slip(f) for f in (1e-3, 1e3)},
    **{f"mass x {f:g}": body_slip("mass", f) for f in (1e-6, 1e-3, 1e3)},
    **{f"centre x {f:g}": body_slip("centre", f) for f in (1e3, 25.4)},
    **{f"size x {f:g}": body_slip("size", f) for f in (1e-3, 1e-1, 1e1, 1e3)},
    **{f"diameter x {f:g}": body_slip("diameter", f) for f in (1e-3, 1e3)},
    **{f"length x {f:g}": body_slip("length", f) for f in (1e-3, 1e3)},
    **{f"density {f:g}": density_slip(f) for f in (7.2, 7.2e6)},
    **{f"place of a joint x {f:g}": place_slip("joints", f) for f in (1e3, 25.4)},
    **{f"place of a point x {f:g}": place_slip("points", f) for f in (1e3, 25.4)},
    "tip 9 m above": raised_slip(9.0), "tip 900 m above": raised_slip(900.0),
    "sign of a linear axis": sign_slip(False), "sign of a rotary axis": sign_slip(True), "another direction": way_slip,
    "exchanged axes": exchanged_axes, "travel x 1000": limits_slip(1e3), "travel x 1e-3": limits_slip(1e-3),
    "parent and child": reversed_joint, "no tool": tool_left_out, "no mass": omitted("bodies", "mass"),
    "no place": omitted("joints", "at"), "no parent": omitted("joints", "parent"), "no child": omitted("joints", "child"),
    "no direction": omitted("axes", "direction"),
    "screw x 1000 thick": law_slip("ball_screw", "diameter", 1e3), "screw x 1e-3 long": law_slip("ball_screw", "length", 1e-3),
    "screw half as long": law_slip("ball_screw", "length", 0.45), "screw x 1000 long": law_slip("ball_screw", "length", 1e3),
    "nut x 1e-3": law_slip("ball_screw", "nut", 1e-3), "bearing x 1e-3": law_slip("ball_screw", "bearing", 1e-3),
    "nut at x 1000": law_slip("ball_screw", "nut_at", 1e3), "nut at x 1e-3": law_slip("ball_screw", "nut_at", 1e-3),
    "screw that stands still": screw_still,
    "guideway radial x 1e-3": law_slip("guideway", "radial", 1e-3),
    "guideway lateral x 1e-3": law_slip("guideway", "lateral", 1e-3),
    "guideway radial x 1000": law_slip("guideway", "radial", 1e3), "carriages x 1000": law_slip("guideway", "at", 1e3),
    "carriages of the machine": carriages_slip,
    "damping ratio 3": typed("damping_ratio", 0.9), "damping ratio 3e-4": typed("damping_ratio", 3e-4),
    "speeds reversed": cut_slip("speeds", "15000, 4000 rpm"), "diameter of the cut in m": cut_slip("diameter", 25.0),
    "90 deg taken for rad": angle_slip(90.0), "rad taken for deg": angle_slip(math.radians(math.pi / 2)),
}


FINE: dict[str, Slip] = {  # units that are less than 60 apart, places off by a digit
    **{f"a stiffness along x {f:g}, fine": stiffness_slip(f, False, "any") for f in (0.1, 10.0, 9.80665)},
    **{f"a stiffness about x {f:.3g}, fine": turn_slip(f, False) for f in (0.1, 10.0, math.pi / 180, 180 / math.pi)},
    "mass of a solid body in lb": pounds_slip, "centre x 10": body_slip("centre", 10.0),
    "place of a joint x 10": place_slip("joints", 10.0), "place of a point x 10": place_slip("points", 10.0),
    "tip 1 m above": raised_slip(1.0), "travel x 10": limits_slip(10.0),
}
FREE: dict[str, Slip] = {  # what no file contradicts: how hollow a casting is, how firmly a round body is held about its axis
    "mass in lb, any body": body_slip("mass", 2.2046),
    **{f"a stiffness about a body's own or driven axis x {f:.3g}": turn_slip(f, True) for f in (0.1, 10.0, 180 / math.pi)},
}
SLIPS.update(FINE)
SLIPS.update(FREE)


def told(data: Data, path: Path) -> tuple[list[str], bool]:
    """Return the lines that the reader or `check` says of a machine, and whether it was refused."""
    path.write_text(yaml.safe_dump(data, sort_keys=False))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return list(studies.check_machine(io.read_machine(path)).doubts), False
    except ToolpointError as error:
        return str(error).splitlines(), True


def names(line: str, part: str) -> bool:
    """Return whether a line is about a part: a doubt begins with it, a fault has it as a word."""
    if isinstance(line, Doubt):
        return line.what == part or line.what.startswith((part + ".", part if part.endswith(".") else part + "."))
    return re.search(rf"(?<!\w){re.escape(part)}(?!\w)" if not part.endswith(".") else re.escape(part), line) is not None


def main() -> int:
    """Print the share told by kind, the share of true machines doubted, and what was missed."""
    parser = CommandLine(__doc__)
    parser.cases("machines", 200)
    parser.add_argument("--slips", type=int, default=8, help="of every machine")
    parser.seed(0, "first-seed")
    arguments = parser.parse_args()
    counts, hits, other = Counter[str](), Counter[str](), Counter[str]()
    doubted, examples = 0, defaultdict[str, list[str]](list)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "machine.yaml"
        for seed in range(arguments.first_seed, arguments.first_seed + arguments.machines):
            rng = np.random.default_rng(seed)
            name = TEMPLATES[seed % len(TEMPLATES)]
            data = random_machine(name, rng)
            lines, refused = told(data, path)
            if lines:
                doubted += 1
                print(f"true machine {seed} ({name}){' refused' if refused else ''}: {lines[0]}", file=sys.stderr)
            before = set(lines)
            least = sorted(SLIPS, key=lambda kind: (counts[kind], rng.random()))
            done = 0
            for kind in least:
                if done == arguments.slips:
                    break
                changed = copy.deepcopy(data)
                part = SLIPS[kind](changed, rng)
                if part is None:
                    continue
                done += 1
                counts[kind] += 1
                more = [line for line in told(changed, path)[0] if line not in before]
                if any(names(line, word) for line in more for word in part.split("|")):
                    hits[kind] += 1
                else:
                    other[kind] += bool(more)
                    examples[kind].append(f"{name} {seed} {part}: {more[:1]}")
    for kind in sorted(counts, key=lambda k: hits[k] / counts[k]):
        if hits[kind] < counts[kind]:
            print(f"{kind}: {hits[kind]} of {counts[kind]} told, {other[kind]} under another name; {examples[kind][0]}")
    for words, kinds in (("free (valid machines have it)", [k for k in counts if k in FREE]),
                         ("fine", [k for k in counts if k in FINE]),
                         ("coarse", [k for k in counts if k not in FINE and k not in FREE])):
        total = sum(counts[k] for k in kinds)
        print(f"{words}: {len(kinds)} kinds, {total} slips: {100 * sum(hits[k] for k in kinds) / max(total, 1):.1f} % told by "
              f"name, {100 * sum(other[k] for k in kinds) / max(total, 1):.1f} % under another name only")
    print(f"true machines doubted: {doubted} of {arguments.machines}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
