from toolpoint import Modes
from toolpoint.cutting import CuttingCoefficients, Engagement, MillingProblem, Tool, stability


def solve(data):
    mode = Modes([float(data["frequency"])], [float(data["damping"])], [[float(data["mass"]) ** -0.5]], ("tool:+x",))
    cut = MillingProblem(Tool(0.01, 2), Engagement.down(float(data["immersion"])),
                         CuttingCoefficients(float(data["kt"]), float(data["kn"])), mode, "tool:+x", None)
    return {"x": stability.chart(cut, data["speeds"], depth_max=float(data["deepest"])).limit}
