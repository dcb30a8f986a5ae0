from toolpoint import Frf
from toolpoint.modal_identification import identify


def solve(data):
    dofs = [f"{i + 1}:+z" for i in range(data["values"].shape[1])]
    modes = identify(Frf(data["lines"], data["values"], dofs, dofs[:1], "accelerance"), band=(20.0, 490.0)).modes
    return {"f": modes.frequency, "z": modes.damping_ratio}
