"""A project is begun, given a machine, a cut and a goal, and written as a workbench that opens without a server."""

import tempfile
from pathlib import Path

from toolpoint.io import read_machine, write_machine
from toolpoint.project import Project, add_files, add_part, change_machine, write_folder
from toolpoint.workbench import export_workbench

MACHINE = """toolpoint: 1
name: Slide
bodies: {head: {mass: 100 kg, centre: [0, 0, 0.3], shape: {kind: box, size: [0.4, 0.4, 0.4]}}}
joints: {slide: {parent: ground, child: head, stiffness: {x: 2e7, y: 3e7, z: 9e7}, loss_factor: 0.06}}
points: {tip: {body: head, at: [0, 0, 0]}}
tool: tip
"""
CUT = "{diameter: 50 mm, teeth: 5, immersion: 0.6, tangential: 1900 MPa, normal: 700 MPa, coefficient_deviation: 8 %, " \
      "speeds: 800 1600 rpm}"


def main() -> int:
    """Return how many of the written pages there are."""
    with tempfile.TemporaryDirectory() as name:
        folder, mill = Path(name) / "project", Path(name) / "mill.yaml"
        write_folder(folder)
        mill.write_text(MACHINE)
        machine = read_machine(mill)
        # A number that a person sets: the joint is marked as chosen, and the file carries a doubt.
        write_machine(change_machine(machine, {"joints.slide.stiffness.x": 2.4e7}).description, Path(name) / "machine.yaml")
        print(add_files(folder, [Path(name) / "machine.yaml"]).parts)
        add_part(folder, "cuts.face", CUT)
        add_part(folder, "goals.roughing", "{speed: 1200 rpm, depth: 2 mm}")
        print(Project.open(folder).run(["machine"]).table())
        # `toolpoint serve project` opens the same with a server, where every slider is free.
        index = export_workbench(folder, Path(name) / "shared")
        return len(list((index.parent / "pages").iterdir()))


if __name__ == "__main__":
    main()
