import numpy as np
import sdynpy as sd
from sdynpy.modal.sdynpy_polypy import PolyPy


def solve(data):
    count = data["values"].shape[1]
    out, ref = sd.coordinate_array(np.arange(count)[:, None] + 1, 3), sd.coordinate_array(np.array([1]), 3)
    pairs = np.stack(np.broadcast_arrays(out, ref), axis=-1)
    kind = sd.data.FunctionTypes.FREQUENCY_RESPONSE_FUNCTION
    model = PolyPy(sd.data_array(kind, data["lines"], np.moveaxis(data["values"], 0, -1), pairs), 20, 490, 2)
    model.compute_poles(np.arange(2, 41, 2))
    last = max(model.pole_list, key=len)
    f, z = np.abs(last["omega"]) / 2 / np.pi, last["zeta"]
    places = [int(np.argmin(np.abs(f - hint))) for hint in data["hint"]]
    return {"f": f[places], "z": z[places]}
