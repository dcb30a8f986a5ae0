"""Responses of a tapped tool to speeds to use, with a light for each step (as `toolpoint tap tip.h5 --diameter 12 ...`)."""

import tempfile

import numpy as np

from toolpoint.pages.testing.tap import tap_page
from toolpoint.studies import study_tap
from toolpoint.vibration import Modes, frequency_response

TIP = Modes([920.0, 1480.0], [0.03, 0.025], [[2.1, 1.3]], ["tip:+x"])
CUT = {"diameter": 0.012, "teeth": 4, "direction": "slot", "tangential": 8e8, "normal": 2e8}


def main() -> float:
    """Return the least stable depth of the rough chart over the exact one at the least depth's speed."""
    frf = frequency_response.modal(TIP, np.arange(60.0, 3000.0, 2), inputs=["tip:+x"])
    rng = np.random.default_rng(0)
    size = 1e-3 * np.abs(frf.values).mean()
    noisy = type(frf)(frf.frequency, frf.values + size * rng.standard_normal(frf.values.shape), frf.outputs, frf.inputs)
    result = study_tap(noisy, values=CUT, speeds=(6000.0, 18000.0), rng=rng)
    print(result.table())
    print("strike again:", *result.again, sep="\n- ")
    with tempfile.TemporaryDirectory() as folder:
        print(tap_page(result).save(folder))
    return float(result.limits.rough.limit.min() / result.limits.lowest[0])


if __name__ == "__main__":
    main()
