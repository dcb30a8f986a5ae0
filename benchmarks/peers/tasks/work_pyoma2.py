import numpy as np
from pyoma2.algorithms import SSI
from pyoma2.setup import SingleSetup


def solve(data):
    setup = SingleSetup(data["samples"], fs=float(data["rate"]))
    setup.add_algorithms(SSI(name="ssi", br=30, ordmax=40))
    setup.run_by_name("ssi")
    setup.mpe("ssi", sel_freq=[float(hint) for hint in data["hint"]], order_in="find_min")
    return {"f": np.ravel(setup["ssi"].result.Fn), "z": np.ravel(setup["ssi"].result.Xi)}
