"""The probability that a cut is stable, the best cut, and the next test cut (as `toolpoint lobes --probability 200`)."""

import tempfile

import numpy as np

from toolpoint.pages.cuts.lobes import lobes_page
from toolpoint.studies import Uncertainty, chart_lobes, modal_dynamics
from toolpoint.vibration import Modes

CUT = {"diameter": 0.012, "teeth": 2, "direction": "slot", "tangential": 6e8, "normal": 2e8}


def main() -> float:
    """Return the share of the sampled charts in which the shallowest depth is stable at every speed: all of them."""
    tip = Modes([922.0, 922.0], 0.011, np.eye(2) / np.sqrt(0.03993), ("tip:+x", "tip:+y"))
    known = Uncertainty(20, cuts=((12000.0, 0.3e-3, False),))  # a cut that was made, and chattered
    result = chart_lobes(modal_dynamics(tip), CUT, speeds=np.linspace(8000, 20000, 30), uncertainty=known)
    print(result.table())
    with tempfile.TemporaryDirectory() as folder:
        print(lobes_page(result).save(folder))
    assert result.probability is not None
    return float(result.probability.stable[:, :, 0].mean())


if __name__ == "__main__":
    main()
