"""A fixture taken away from a measured whole: two parts joined in three ways, and decoupled again by their responses."""

import numpy as np

from toolpoint.substructuring.coupling import couple, couple_dual, join_elastically
from toolpoint.substructuring.frequency_coupling import couple_responses, decouple_responses
from toolpoint.vibration import Dof, Frf, SecondOrderSystem, frequency_response

LINES = np.linspace(1.0, 40.0, 80)


def chain(masses: list[float], springs: list[float], first: int) -> SecondOrderSystem:
    """Return masses on a line with springs between neighbours; points numbered from `first`."""
    k = np.zeros((len(masses), len(masses)))
    for i, spring in enumerate(springs):
        k[i:i + 2, i:i + 2] += spring * np.array([[1, -1], [-1, 1]])
    return SecondOrderSystem(np.diag(masses), k, structural_damping=0.03 * k,
                             outputs=[Dof(first + i, "+x") for i in range(len(masses))])


def main() -> float:
    """Print how the ways agree; return the largest difference of the part that is got back, over its peak."""
    part, fixture = chain([5.0, 3.0, 4.0], [2e5, 1e5], 1), chain([1.0, 30.0], [3e5], 3)
    parts, links = {"part": part, "fixture": fixture}, [("part.3:+x", "fixture.3:+x")]
    whole = frequency_response.direct(couple(parts, links), LINES)
    dual, force = couple_dual(parts, links).respond(LINES)
    alone = frequency_response.direct(part, LINES)
    joined = couple_responses({"part": alone, "fixture": frequency_response.direct(fixture, LINES)}, links)
    print(f"receptance at 1, largest of the band: primal {np.abs(whole.values[:, 0, 0]).max():.6g} m/N, dual "
          f"{np.abs(dual.values[:, 0, 0]).max():.6g}, by responses {np.abs(joined.values[:, 0, 0]).max():.6g}")
    print(f"force in the joint per force at 1, largest {np.abs(force[:, 0, 0]).max():.3g}")
    soft = frequency_response.direct(join_elastically(parts, links, np.array([[5e4]])), LINES)
    print(f"with a spring of 5e4 N/m between them: {np.abs(soft.values[:, 0, 0]).max():.6g} m/N")
    measured = Frf(LINES, joined.values[:, :3, :3], ["1:+x", "2:+x", "3:+x"], ["1:+x", "2:+x", "3:+x"])
    back = decouple_responses(measured, frequency_response.direct(fixture, LINES), ["3:+x"])
    return float(np.abs(back.values - alone.values).max() / np.abs(alone.values).max())


if __name__ == "__main__":
    main()
