"""A project of a drawn machine: its goal's limit with an interval, and how a cut that was tried narrows it."""

import tempfile
from pathlib import Path

from toolpoint.io import write_template
from toolpoint.pages.project.project import project_page
from toolpoint.project import Project, TriedCut

PROJECT = """toolpoint: 1
name: Example mill
machine: machine.yaml
cuts:
  face: {diameter: 50 mm, teeth: 5, immersion: 0.6, tangential: 1900 MPa, normal: 700 MPa, coefficient_deviation: 15 %,
         speeds: 500 2500 rpm}
goals:
  roughing: {speed: 1200 rpm, depth: 2 mm}
draws: 40
"""


def main() -> float:
    """Return the width of the interval after a tried cut over that before it."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_template(folder / "machine.yaml", "machine", "three-axis-vertical")
        (folder / "project.yaml").write_text(PROJECT)
        before = Project.open(folder).run()
        print(before.table())
        lower, upper = before.goal("roughing")["interval_m"]
        Project.open(folder).report_cut(TriedCut(1200.0, before.goal("roughing")["next_cut"]["depth_m"], stable=True))
        after = Project.open(folder).run()
        print(after.answers[0])
        print(project_page(after).save(folder))
        return (after.goal("roughing")["interval_m"][1] - after.goal("roughing")["interval_m"][0]) / (upper - lower)


if __name__ == "__main__":
    main()
