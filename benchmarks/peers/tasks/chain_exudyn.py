import exudyn
import numpy as np


def solve(data):
    system = exudyn.SystemContainer().AddSystem()
    k, last = float(data["stiffness"]), system.CreateGround()
    for number in range(int(data["count"])):
        body = system.CreateMassPoint(referencePosition=[number + 1.0, 0, 0], physicsMass=float(data["mass"]))
        system.CreateCartesianSpringDamper(bodyNumbers=[last, body], stiffness=[k, 1e9 * k, 1e9 * k], damping=[0, 0, 0])
        last = body
    system.Assemble()
    values = np.sort(np.real(system.ComputeODE2Eigenvalues(computeComplexEigenvalues=False)[0]))[:int(data["count"])]
    return {"f": np.sqrt(values) / 2 / np.pi, "z": 0 * values}
