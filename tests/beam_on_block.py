"""Machine file of two elastic bodies: a beam that slides on a block."""

WAYS = ("x", "y", "z", "rx", "ry", "rz")
GUIDE = (4e7, 6e7, 5e7, 2e5, 2e5, 1e5)
# A beam that slides on a block: both elastic; the joint rides on the block, so the beam's way slides.
PAIR = """toolpoint: 1
name: beam on block
bodies:
  block:
    elastic:
      boxes: [{low: [0, 0, 0], high: [200 mm, 100 mm, 100 mm]}]
      mesh_size: 100 mm
      band: 2500 Hz
      interfaces:
        foot: {centre: [0.1, 0.05, 0], along: [1, 0, 0], across: [0, -1, 0], length: 200 mm, width: 100 mm}
        top: {centre: [0.1, 0.05, 0.1], along: [1, 0, 0], across: [0, 1, 0], length: 80 mm, width: 60 mm}
  beam:
    frame: {at: [-0.2, 0, 0.1]}
    elastic:
      boxes: [{low: [0, 0, 0], high: [600 mm, 100 mm, 50 mm]}]
      mesh_size: 100 mm
      band: 2500 Hz
      interfaces:
        way: {centre: [0.3, 0.05, 0], along: [1, 0, 0], across: [0, 1, 0], length: 80 mm, width: 60 mm, slide: [-0.2, 0.2]}
        end: {centre: [0.6, 0.05, 0.025], along: [0, 1, 0], across: [0, 0, 1], length: 100 mm, width: 50 mm}
joints:
  foot: {parent: ground, child: block, at: [0.1, 0.05, 0], child_interface: foot FOOT}
  guide: {parent: block, child: beam, at: [0.1, 0.05, 0.1], parent_interface: top, child_interface: way, elastic_at: parent,
          stiffness: {GUIDE}}
axes: {X: {joint: guide, direction: x, limits: [-150 mm, 150 mm]}}
points: {end: {body: beam, interface: end}}
"""


def pair(folder, foot="", extra="", reduction="0"):
    path = folder / "pair.yaml"
    extra = extra if "reduction_error" in extra else f"{extra}reduction_error: {reduction}\n" if reduction else extra
    guide = ", ".join(f"{way}: {value:g}" for way, value in zip(WAYS, GUIDE, strict=True))
    path.write_text(PAIR.replace("FOOT", foot).replace("GUIDE", guide) + extra)
    return path
