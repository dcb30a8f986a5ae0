from toolpoint import Record
from toolpoint.modal_identification import identify_operational


def solve(data):
    names = [f"{i + 1}:+x" for i in range(data["samples"].shape[1])]
    modes = identify_operational(Record(data["samples"], float(data["rate"]), names, ("acceleration",) * len(names))).modes
    return {"f": modes.frequency, "z": modes.damping_ratio}
