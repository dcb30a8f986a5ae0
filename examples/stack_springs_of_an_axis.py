"""The stiffness of a feed axis: ball screw and bearings behind each other, guideways beside them."""

import numpy as np

from toolpoint.joints import join_parallel, join_series

SCREW, BEARING, GUIDE = 180e6, 400e6, 900e6  # N/m: screw with nut along x, its bearing along x, guideways across


def spring(**stiffness: float) -> np.ndarray:
    """Return the (6, 6) stiffness of a part by direction."""
    return np.diag([stiffness.get(way, 0.0) for way in ("x", "y", "z", "rx", "ry", "rz")])


def main() -> float:
    """Return the axis's stiffness along x over that of two springs behind each other by hand."""
    drive = join_series([spring(x=SCREW), spring(x=BEARING)])
    axis = join_parallel([drive, spring(y=GUIDE, z=GUIDE, rx=4e7, ry=4e7, rz=4e7)])
    print("along x, y, z, N/um:", (np.diag(axis)[:3] / 1e6).round(1))
    return float(axis[0, 0] * (1 / SCREW + 1 / BEARING))


if __name__ == "__main__":
    main()
