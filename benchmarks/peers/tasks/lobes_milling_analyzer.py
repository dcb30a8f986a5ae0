import numpy as np
from src.mill import Mill, MillingDirection
from src.solver import Solver, VariableName, Varying


def solve(data):
    mill = Mill(2, float(data["kt"]), float(data["kn"]), float(data["damping"]), float(data["immersion"]),
                float(data["frequency"]), float(data["mass"]), MillingDirection.DOWN)
    first, last, steps = data["speeds"][0], data["speeds"][-1], len(data["speeds"])
    step = (last - first) / (steps - 1)
    grid = Solver(mill, Varying(VariableName.SPINDLE_SPEED, first, last + step, steps),
                  Varying(VariableName.DEPTH_OF_CUT, 1e-6, float(data["deepest"]), 50))
    _, depths, growth = grid.solve()
    limits = []
    for depth, size in zip(depths, growth):
        place = int(np.argmax(size > 1))
        share = (1 - size[place - 1]) / (size[place] - size[place - 1])
        limits.append(depth[place - 1] + share * (depth[place] - depth[place - 1]))
    return {"x": limits}
