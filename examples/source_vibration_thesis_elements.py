"""A mill by finite elements as the thesis has one: ten modes, correlation with a test, sensitivity to E and density."""

from typing import Any

import numpy as np

from toolpoint.studies.finite_elements.example_mill import example_mill, example_tested_mill
from toolpoint.studies.finite_elements.machine_study import study_finite_elements


def main(draws: int = 2) -> dict[str, Any]:
    """Return the numbers of the page, by name; nothing is drawn here."""
    mill = example_mill(mesh_size=0.5)
    study = study_finite_elements(mill, tested=example_tested_mill(mill), damper_mass=20.0, rng=np.random.default_rng(1))
    print(study.table())
    assert study.correlation is not None
    total = study.correlation.correlation.coefficients
    assert total is not None
    numbers = {f"fe{k}": value for k, value in enumerate(study.modes.frequency[:10], 1)}
    numbers |= {"cc_mean": total.mean, "cc_mass": total.mass, "cc_displacement": total.weight @ total.displacement,
                "cc_mac": total.weight @ total.mac,
                "cc_total": total.total}
    for part, change in study.sensitivities.items():
        numbers |= {f"{part}_e": change.modulus.sum(axis=1)[0], f"{part}_density": change.density.sum(axis=1)[0]}
    return {name: float(value) for name, value in numbers.items()}


if __name__ == "__main__":
    main()
