"""Modes by quadrature picking and lobes from one driving-point response (as `toolpoint report --frf`)."""

import numpy as np

from toolpoint.studies import study_responses
from toolpoint.vibration import Modes, frequency_response


def main() -> float:
    """Return the damping of the first mode that is picked, per cent; 3 % were put in."""
    tip = Modes([920.0, 1480.0], [0.03, 0.025], [[2.1, 1.3]], ["tip:+x"])
    response = frequency_response.modal(tip, np.arange(60.0, 3000.0, 2.0), inputs=["tip:+x"])
    study = study_responses(response)
    print(study.table())
    assert study.modes is not None
    return 100 * float(study.modes.damping_ratio[0])


if __name__ == "__main__":
    main()
