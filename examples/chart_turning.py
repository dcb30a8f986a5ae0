"""Stable widths of a turning cut, and the width that is stable at every speed (as `toolpoint turn --frf tip.txt`)."""

import tempfile

import numpy as np

from toolpoint.pages.cuts.turning import turning_page
from toolpoint.studies import TurningCut, chart_turning, response_dynamics
from toolpoint.vibration import Modes, frequency_response

CUTTING, STIFFNESS, RATIO = 1.5e9, 2e7, 0.03


def main() -> float:
    """Return the unconditional width over that of one mode by hand, 2 k zeta (1 + zeta) / K_f."""
    tip = Modes([150.0], RATIO, [[2 * np.pi * 150.0 / np.sqrt(STIFFNESS)]], ("tip:+x",))
    frf = frequency_response.modal(tip, np.arange(1.0, 600.0, 0.1))
    result = chart_turning(response_dynamics(frf, band=(10, 600)), TurningCut(CUTTING), np.linspace(500, 5000, 100))
    print(result.table())
    with tempfile.TemporaryDirectory() as folder:
        print(turning_page(result).save(folder))
    assert result.limit is not None
    return result.limit.width / (2 * STIFFNESS * RATIO * (1 + RATIO) / CUTTING)


if __name__ == "__main__":
    main()
