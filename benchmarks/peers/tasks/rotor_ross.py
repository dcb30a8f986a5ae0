import numpy as np
import ross


def solve(data):
    steel = ross.Material("steel", rho=float(data["density"]), E=float(data["modulus"]), Poisson=0.3)
    elements = [ross.ShaftElement(L=float(data["length"]) / 20, idl=0, odl=float(data["diameter"]), material=steel,
                                  shear_effects=False, rotary_inertia=False, gyroscopic=False) for _ in range(20)]
    rotor = ross.Rotor(elements, [], [ross.BearingElement(n=k, kxx=1e11, cxx=0) for k in (0, 20)])
    f = rotor.run_modal(0.0, num_modes=24).wn / 2 / np.pi
    return {"f": f, "z": 0 * f}
