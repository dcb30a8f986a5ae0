"""A project is begun, given a machine, a cut and a goal, and written as a workbench that opens without a server."""

import tempfile
from pathlib import Path

from toolpoint.io import read_machine, write_machine, write_template
from toolpoint.project import Project, add_files, add_part, change_machine, write_folder
from toolpoint.workbench import export_workbench

CUT = "{diameter: 50 mm, teeth: 5, immersion: 0.6, tangential: 1900 MPa, normal: 700 MPa, coefficient_deviation: 8 %, " \
      "speeds: 800 1600 rpm}"


def main() -> int:
    """Return how many of the written pages there are."""
    with tempfile.TemporaryDirectory() as name:
        folder, mill = Path(name) / "project", Path(name) / "mill.yaml"
        write_folder(folder)
        write_template(mill, "machine", "three-axis-vertical")
        machine = read_machine(mill)
        # A number that a person sets: the joint is marked as chosen, and the file carries a doubt.
        path = next(path for path in (f"joints.{joint}.stiffness.{way}" for joint, law in machine.description.joints.items()
                                      for way in law.stiffness))
        write_machine(change_machine(machine, {path: 1.2 * machine.value(path)}).description, Path(name) / "machine.yaml")
        print(add_files(folder, [Path(name) / "machine.yaml"]).parts)
        add_part(folder, "cuts.face", CUT)
        add_part(folder, "goals.roughing", "{speed: 1200 rpm, depth: 2 mm}")
        for entry in Project.open(folder).outlook():
            print(entry.step.name, entry.state)
        print(Project.open(folder).run(["machine"]).table())
        # `toolpoint serve project` opens the same with a server, where every slider is free.
        index = export_workbench(folder, Path(name) / "shared")
        return len(list((index.parent / "pages").iterdir()))


if __name__ == "__main__":
    main()
