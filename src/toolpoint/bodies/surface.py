"""BodySurface: the drawn surface of an elastic body, and its motion by the body's coordinates."""

from __future__ import annotations

from dataclasses import dataclass

from toolpoint._check import FloatArray, IndexArray, fail, floats, frozen


@dataclass(frozen=True, eq=False)
class BodySurface:
    """Nodes and triangles of a body's outside, in its frame.

    nodes : (n, 3) floats, m; triangles : (t, 3) node numbers; motion : (n, 3, n_modal) floats, displacement of every node per
    modal coordinate, beside the motion of the body's frame.
    """

    nodes: FloatArray
    triangles: IndexArray
    motion: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "nodes", floats("BodySurface.nodes", self.nodes, (None, 3)))
        object.__setattr__(self, "motion", floats("BodySurface.motion", self.motion, (len(self.nodes), 3, None)))
        if self.triangles.ndim != 2 or self.triangles.shape[1] != 3 or self.triangles.max(initial=0) >= len(self.nodes):
            fail("BodySurface.triangles", f"shape {self.triangles.shape}", f"must be (t, 3) of {len(self.nodes)} nodes")
        object.__setattr__(self, "triangles", frozen(self.triangles.astype("int64")))
