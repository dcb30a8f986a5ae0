import numpy as np
from pyfbs.modal_id.modal_id import ModalID


def solve(data):
    inside = (data["lines"] >= 20) & (data["lines"] <= 490)
    model = ModalID(data["lines"][inside], data["values"][inside])
    model.p_lscf(40)
    s = np.array(model.poles[-1]).ravel()
    f, z = np.abs(s) / 2 / np.pi, -s.real / np.abs(s)
    good = (z > 0.001) & (z < 0.1)
    places = [int(np.argmin(np.abs(f[good] - hint))) for hint in data["hint"]]
    return {"f": f[good][places], "z": z[good][places]}
