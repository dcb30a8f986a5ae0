import numpy as np
from scipy.sparse.linalg import eigsh
from skfem import Basis, BilinearForm, ElementLineHermite, MeshLine
from skfem.helpers import dd, ddot


def solve(data):
    length, stiffness, line_mass = (float(data[name]) for name in ("length", "bending_stiffness", "line_mass"))
    basis = Basis(MeshLine(np.linspace(0, length, 21)), ElementLineHermite())
    k = BilinearForm(lambda u, v, w: stiffness * ddot(dd(u), dd(v))).assemble(basis)
    m = BilinearForm(lambda u, v, w: line_mass * u * v).assemble(basis)
    free = np.setdiff1d(np.arange(basis.N), basis.get_dofs(lambda x: x[0] == 0).all())
    values = eigsh(k[free][:, free], 3, m[free][:, free], sigma=0, return_eigenvectors=False)
    return {"f": np.sqrt(np.sort(values)) / 2 / np.pi, "z": np.zeros(3)}
