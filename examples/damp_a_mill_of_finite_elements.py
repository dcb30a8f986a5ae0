"""A mill of castings by finite elements: where its energy sits, a virtual hammer test beside it, and a damper tuned for the
depth of a cut (as `toolpoint demo finite-element-mill`, on a coarse mesh)."""

import tempfile

import numpy as np

from toolpoint.pages.machines.finite_elements import finite_element_page
from toolpoint.studies import tune_damper
from toolpoint.studies.finite_elements.example_mill import example_mill, example_tested_mill
from toolpoint.studies.finite_elements.machine_study import study_finite_elements


def main() -> float:
    """Return the shares of all parts and joints in the energy of the first mode, added up."""
    mill = example_mill(mesh_size=0.5)
    study = study_finite_elements(mill, tested=example_tested_mill(mill), damper_mass=20.0, rng=np.random.default_rng(1))
    print(study.table())
    with tempfile.TemporaryDirectory() as folder:
        print(finite_element_page(study).save(folder))
    lines = np.linspace(20.0, 120.0, 2001)
    print("for the least peak:", tune_damper(study.modes, "tool:+x", "tool:+x", mass=20.0, lines=lines).to_dict())
    return float(sum(share[0] for share in (*study.part_shares.values(), *study.joint_shares.values())))


if __name__ == "__main__":
    main()
