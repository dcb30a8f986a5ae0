"""The process that meshes a STEP file with Netgen; run as a script by `step_file`.

One request on standard input (JSON: path, size in mm or null, result), the geometry or the mesh as plain arrays in the file
`result`, faults as words on standard error with exit code 3. It may crash or be ended: its parent lives on. It imports
nothing of the package.
"""

from __future__ import annotations

import importlib.metadata
import json
import sys
from typing import Any

import numpy as np

# Netgen's sides are 1-2 1-3 1-4 2-3 2-4 3-4; ours 1-2 2-3 3-1 1-4 2-4 3-4.
_MID_NODES_OF_NETGEN = [0, 1, 2, 3, 4, 7, 5, 6, 8, 9]
# About what a body of a machine can be reduced with in 16 GB of memory.
MAX_ELEMENT_COUNT = 3_000_000


def read_solid(path: str) -> Any:
    """Return the one solid of a file, lengths in mm as OpenCASCADE converts them."""
    from netgen.occ import OCCGeometry

    solids = list(OCCGeometry(path).shape.solids)
    if not solids:
        raise ValueError("no solid; surfaces alone have no inside: export a closed body")
    if len(solids) != 1:
        names = ", ".join(f"{solid.name or 'unnamed'} {_extent(solid)} mm" for solid in solids[:4])
        raise ValueError(f"{len(solids)} solids: {names}; must be one body; export each alone, or unite them in the program "
                         "that drew them")
    if not solids[0].mass > 0:
        raise ValueError(f"volume {solids[0].mass:g} mm^3; must be above zero; the solid is open or inside out: heal it and "
                         "export it again")
    return solids[0]


def measure(solid: Any) -> dict[str, Any]:
    """Return volume, centre, corners and inertia about the centre (of unit density, mm^5) of the geometry, mm."""
    lower, upper, centre = (np.array([p.x, p.y, p.z]) for p in (*solid.bounding_box, solid.center))
    inertia = np.array([[solid.inertia[i, j] for j in range(3)] for i in range(3)])
    return {"volume": float(solid.mass), "centre": centre, "low": lower, "high": upper, "inertia": inertia}


def mesh_solid(solid: Any, size: float) -> dict[str, Any]:
    """Return nodes (mm) and elements of at most `size` (mm), and who made them."""
    from netgen.occ import OCCGeometry

    about = 12 * float(solid.mass) / size**3
    if about > MAX_ELEMENT_COUNT:
        raise ValueError(f"mesh_size {size:g} mm in {solid.mass:.4g} mm^3 would give about {about:.2g} elements; must be below "
                         f"{MAX_ELEMENT_COUNT:g}; take larger elements")
    mesh = OCCGeometry(solid).GenerateMesh(maxh=size)
    mesh.SecondOrder()
    elements = np.ascontiguousarray(mesh.Elements3D().NumPy()["nodes"])
    if elements.ndim != 2 or elements.shape[1] != 10 or not len(elements):
        raise ValueError(f"a mesh of {len(elements)} elements; must be tetrahedra; take a smaller mesh_size")
    nodes = np.array([point.p for point in mesh.Points()])
    used, inverse = np.unique(elements - 1, return_inverse=True)
    return {"nodes": nodes[used], "elements": inverse.reshape(elements.shape)[:, _MID_NODES_OF_NETGEN].astype(np.int64),
            "mesher": f"Netgen {importlib.metadata.version('netgen-mesher')}"}


def _extent(solid: Any) -> str:
    lower, upper = solid.bounding_box
    return " x ".join(f"{b - a:.4g}" for a, b in ((lower.x, upper.x), (lower.y, upper.y), (lower.z, upper.z)))


def main() -> int:
    """Answer one request."""
    request = json.loads(sys.stdin.readline())
    try:
        solid = read_solid(request["path"])
        content = measure(solid) if request["size"] is None else mesh_solid(solid, request["size"])
    except Exception as error:
        words = str(error).splitlines()
        sys.stderr.write(f"\nfault: {words[0] if words else type(error).__name__}\n")
        return 3
    np.savez(request["result"], **content)
    return 0


if __name__ == "__main__":
    sys.exit(main())
