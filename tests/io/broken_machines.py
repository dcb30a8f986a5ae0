"""Thirty-odd broken machine files: name, change of the good file (old text, new text) or whole text, and what must be said."""

GOOD = """\
toolpoint: 1
name: test stand
bodies:
  column:
    mass: 800 kg
    centre: [0, 0, 1]
    inertia: {xx: 250, yy: 260, zz: 60}
  head:
    mass: 200 kg
    centre: "300, 0, 1500 mm"
    shape: {kind: box, size: "0.4, 0.3, 0.6 m"}
joints:
  foot:
    parent: ground
    child: column
    stiffness: {z: 200 N/um, rx: 5e7 N*m/rad, ry: 5e7}
    loss_factor: 4 %
  guide:
    parent: column
    child: head
    at: [0.3, 0, 1.5]
    stiffness: {z: 1e8}
axes:
  Z: {joint: guide, direction: z, limits: "-300, 300 mm"}
points:
  tool: {body: head, at: [0.3, 0, 1.1]}
tool: tool
poses:
  - {Z: 0.1}
"""

# name: (old, new, [(line, text in the message) ...]); every pair must be reported, in one go.
CHANGED = {
    "wrong unit": ("800 kg", "800 mm", [(5, "unit 'mm' is not one of mass")]),
    "unknown unit": ("800 kg", "800 kilo", [(5, "unknown unit 'kilo'")]),
    "unit with a wrong prefix": ("200 N/um", "200 N/xm", [(16, "unknown unit 'xm'")]),
    "rotational stiffness without rad": ("5e7 N*m/rad", "5e7 N*m", [(16, "write the rad")]),
    "stiffness in compliance unit": ("200 N/um", "200 um/N", [(16, "not one of stiffness")]),
    "missing body": ("child: head", "child: haed", [(20, "did you mean 'head'"), (8, "hangs on no joint")]),
    "loop of parents": ("parent: ground", "parent: head", [(14, "hangs on itself")]),
    "own parent": ("parent: column", "parent: head", [(19, "hangs on itself: head -> head")]),
    "ground as child": ("parent: column\n    child: head", "parent: head\n    child: ground",
                        [(20, "ground cannot be a child"), (8, "hangs on no joint")]),
    "two parents": ("  guide:\n    parent: column", "  other: {parent: ground, child: head}\n  guide:\n    parent: column",
                    [(21, "already hangs on joint other")]),
    "negative mass": ("800 kg", "-800 kg", [(5, "greater than 0")]),
    "zero mass": ("800 kg", "0 kg", [(5, "greater than 0")]),
    "no mass": ("    mass: 800 kg\n", "", [(4, "mass: missing")]),
    "triangle inequality": ("zz: 60", "zz: 600", [(7, "triangle inequality")]),
    "negative inertia": ("zz: 60", "zz: -60", [(7, "none may be negative")]),
    "inertia left out": ("    inertia: {xx: 250, yy: 260, zz: 60}\n", "", [(4, "inertia: missing")]),
    "inertia incomplete": (", zz: 60}", "}", [(7, "'zz' is missing")]),
    "duplicate key": ("    centre: [0, 0, 1]\n", "    centre: [0, 0, 1]\n    mass: 900 kg\n", [(7, "already given in line 5")]),
    "duplicate body": ("  head:\n    mass", "  column:\n    mass",
                       [(8, "already given in line 4"), (20, "no body 'head'"), (26, "no body 'head'")]),
    "decimal comma": ("mass: 800 kg", 'mass: "800,5 kg"', [(5, "decimal comma")]),
    "decimal comma in a flow list": ("ry: 5e7}", "ry: 5,5e7}", [(16, "decimal comma")]),
    "unknown key": ("centre: [0, 0, 1]", "center: [0, 0, 1]", [(6, "did you mean 'centre'")]),
    "unknown direction": ("{z: 1e8}", "{zz: 1e8}", [(22, "did you mean 'z'")]),
    "unknown section": ("points:", "pionts:", [(25, "did you mean 'points'"), (27, "no point 'tool'")]),
    "not a number": ("xx: 250", "xx: .nan", [(7, "not a finite")]),
    "infinite": ("{z: 1e8}", "{z: .inf}", [(22, "not a finite")]),
    "absurd magnitude": ("800 kg", "800e9 kg", [(5, "no mass of a machine tool")]),
    "length in mm without its unit": ("at: [0.3, 0, 1.5]", "at: [300, 0, 1500]", [(21, "is in SI")]),
    "too few coordinates": ("centre: [0, 0, 1]", "centre: [0, 0]", [(6, "2 values in [0, 0]; must be 3")]),
    "text for a number": ("800 kg", "heavy", [(5, "does not begin with a number")]),
    "nothing for a number": ("mass: 800 kg", "mass:", [(6, "mass: missing")]),
    "mass and density": ("mass: 200 kg", "mass: 200 kg\n    density: 7200", [(9, "exactly one of them")]),
    "shape without size": (', size: "0.4, 0.3, 0.6 m"', "", [(11, "a box needs it")]),
    "unknown shape": ("kind: box", "kind: cube", [(11, "'cube'")]),
    "axis on no joint": ("joint: guide", "joint: giude", [(24, "did you mean 'guide'")]),
    "axis limits turned round": ('"-300, 300 mm"', '"300, -300 mm"', [(24, "below the upper")]),
    "pose beyond the limits": ("{Z: 0.1}", "{Z: 0.5}", [(29, "beyond the limits")]),
    "pose of no axis": ("{Z: 0.1}", "{Q: 0.1}", [(29, "no axis 'Q'")]),
    "point on no body": ("{body: head", "{body: spindle", [(26, "no body 'spindle'")]),
    "damping ratio in per cent without its sign": ("tool: tool\n", "tool: tool\ndamping_ratio: 3\n", [
        (28, "must be below 1 (3 %?)")]),
    "old version": ("toolpoint: 1", "toolpoint: 7", [(1, "reads version 1")]),
    "no version": ("toolpoint: 1\n", "", [(1, "toolpoint: 1")]),
    "damping of a locked direction": ("    loss_factor: 4 %\n", "    damping: {x: 300 N*s/m}\n",
                                      [(17, "direction x is locked")]),
    "free and elastic": ("    loss_factor: 4 %\n", "    free: [z]\n", [(17, "also elastic")]),
    "missing mesh": ('shape: {kind: box, size: "0.4, 0.3, 0.6 m"}', "mesh: {file: none.stl}", [(11, "cannot be read")]),
    "hertz for rpm": ("tool: tool\n", 'tool: tool\ncutting: {diameter: 20 mm, teeth: 4, immersion: 0.5, tangential: 2 GPa, '
                      'normal: 1 GPa, speeds: "50, 100 Hz"}\n', [(28, "kept apart")]),
}

WHOLE = {
    "tab": ("toolpoint: 1\nbodies:\n\tcolumn: {mass: 1}\n", [(3, "not valid YAML")]),
    "unclosed bracket": ("toolpoint: 1\nname: [a, b\nbodies: {}\n", [(3, "not valid YAML")]),
    "a list": ("- 1\n- 2\n", [(1, "not a machine file")]),
    "empty": ("", [(1, "not a machine file")]),
    "recursive alias": ("toolpoint: 1\nname: x\nbodies: &b {column: *b}\njoints: {}\n", [(3, "alias that contains itself")]),
}

SEVERAL = """\
toolpoint: 1
name: several
bodies:
  column: {mass: -5 kg, inertia: {xx: 1, yy: 1, zz: 5}, colour: red}
  head: {mass: "1,5 kg", inertia: {xx: .nan, yy: 1, zz: 1}}
joints:
  foot: {parent: ground, child: colum, at: [0, 0], stiffness: {rx: 3 N*m}}
  foot: {parent: ground, child: head}
gravity: [0, 0, -9810000]
"""
