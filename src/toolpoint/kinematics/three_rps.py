r"""3-RPS parallel head in closed form: leg lengths, parasitic motion, and all poses that given leg lengths allow.

Revolute joints at radius R on the base with tangential axes, spherical joints at radius r on the platform, at 0, 120 and 240
degrees; each limb stays in its radial plane. With tilt and azimuth as in `task` the torsion is zero, and the platform's
centre moves aside by :math:`x = -\frac r2 (1 - \cos\theta)\cos 2\varphi,\ y = \frac r2 (1 - \cos\theta)\sin 2\varphi`.
Source: Carretero, Podhorodeski, Nahon, Gosselin, J. Mech. Des. 122 (2000) 17; for the forward solution Tsai, Robot Analysis,
Wiley 1999, section 3.6.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import ComplexArray, FloatArray, floats, positive
from toolpoint.kinematics.task import orientation

_POLYNOMIAL_SAMPLE_COUNT = 128  # samples of the trigonometric polynomial on the unit circle
_ANGLES = 2 * np.pi / 3 * np.arange(3)
_RADIAL = np.stack([np.cos(_ANGLES), np.sin(_ANGLES), np.zeros(3)], axis=-1)
_UNIT_CIRCLE_TOLERANCE = 1e-4  # distance from the unit circle within which a root is polished as a real angle


@dataclass(frozen=True)
class ThreeRps:
    """Geometry of the head: radius of the base's revolute joints and of the platform's spherical joints, m.

    Examples
    --------
    >>> head = ThreeRps(base=0.3, platform=0.2)
    >>> head.forward(head.inverse(0.8, 0.2, 0.5))[0].round(6).tolist()  # z, tilt and azimuth, of the highest pose
    [0.8, 0.2, 0.5]
    """

    base: float
    platform: float

    def __post_init__(self) -> None:
        positive("ThreeRps.base", self.base)
        positive("ThreeRps.platform", self.platform)

    def parasitic(self, tilt: ArrayLike, azimuth: ArrayLike) -> FloatArray:
        """Return the motion (x, y) of the platform's centre that comes with a tilt, m, shape (..., 2); angles in rad."""
        theta, phi = np.asarray(tilt, float), np.asarray(azimuth, float)
        size = self.platform / 2 * (1 - np.cos(theta))
        return np.stack([-size * np.cos(2 * phi), size * np.sin(2 * phi)], axis=-1)

    def inverse(self, z: ArrayLike, tilt: ArrayLike, azimuth: ArrayLike) -> FloatArray:
        """Return the leg lengths at a height of the platform (m) and tilt and azimuth (rad), m, shape (..., 3)."""
        z, theta, phi = np.broadcast_arrays(*(np.asarray(v, float) for v in (z, tilt, azimuth)))
        centre = np.concatenate([self.parasitic(theta, phi), z[..., None]], axis=-1)
        turn = orientation(theta, phi, np.zeros_like(theta))
        ends = centre[..., None, :] + self.platform * _RADIAL @ np.swapaxes(turn, -1, -2)
        return np.linalg.norm(ends - self.base * _RADIAL, axis=-1)

    def forward(self, legs: ArrayLike) -> FloatArray:
        """Return the poses (z, tilt, azimuth) above the base that leg lengths (3,) allow, m and rad, (n, 3), highest first.

        Limb i ends at radius R - L_i c_i and height L_i s_i. The distance of every two ends is that of the platform's joints:
        three equations in cosines and sines. Two are solved for the second and third limb; the product of the third over
        all four pairs of solutions, times the squared denominators, is a trigonometric polynomial of the first limb's angle.
        Its roots are eigenvalues, and one or two steps of Newton's method bring them to rounding.
        """
        lengths = floats("legs", legs, (3,))
        for value in lengths:
            positive("legs", float(value))
        sample = np.exp(2j * np.pi * np.arange(_POLYNOMIAL_SAMPLE_COUNT) / _POLYNOMIAL_SAMPLE_COUNT)
        coefficients = np.fft.fft(self._solution_product(sample, lengths)) / _POLYNOMIAL_SAMPLE_COUNT
        ordered = np.fft.fftshift(coefficients)
        # A leading coefficient of rounding would be a root far out, which pulls digits from all the others.
        kept = np.flatnonzero(np.abs(ordered) > 1e-12 * np.abs(ordered).max())
        roots = np.roots(ordered[kept[0]:kept[-1] + 1][::-1])
        real_roots = roots[np.abs(np.abs(roots) - 1) < _UNIT_CIRCLE_TOLERANCE]
        angles = [angle for root in real_roots for angle in self._complete_angles(float(np.angle(root)), lengths)]
        poses = [self._pose(np.array(angle), lengths) for angle in angles]
        # Where the limbs pass each other the platform also closes turned half round, which no head is built for.
        upright = [pose for pose in poses if pose is not None and np.abs(self.inverse(*pose) - lengths).max() < 1e-8]
        return np.array(_select_distinct(upright)).reshape(-1, 3)

    def _distance_coefficients(self, first: int, second: int, lengths: FloatArray) -> tuple[float, float, float, float, float]:
        """Return the coefficients of c_i c_j, s_i s_j, c_i, c_j and 1 in |A_i - A_j|^2 - 3 r^2, A the ends of the limbs."""
        a, b, radius = lengths[first], lengths[second], self.base
        # |A_i - A_j|^2 with the radii p = R - a c_i and q = R - b c_j at 120 degrees: p^2 + q^2 + p q, and the heights.
        return (a * b, -2 * a * b, -3 * radius * a, -3 * radius * b,
                3 * radius**2 + a**2 + b**2 - 3 * self.platform**2)

    def _solve_limb(self, c: ComplexArray, s: ComplexArray, other: int, lengths: FloatArray
                    ) -> tuple[list[tuple[ComplexArray, ComplexArray]], ComplexArray]:
        """Return both solutions (cosine, sine) of another limb for the first limb's angle, times their denominator, and it."""
        cc, ss, ci, cj, constant = self._distance_coefficients(0, other, lengths)
        p, q, k = cc * c + cj, ss * s, ci * c + constant
        denominator = p**2 + q**2
        root = np.sqrt(denominator - k**2 + 0j)
        return [((-p * k + sign * q * root), (-q * k - sign * p * root)) for sign in (1, -1)], denominator

    def _solution_product(self, z: ComplexArray, lengths: FloatArray) -> ComplexArray:
        c, s = z.real + 0j, z.imag + 0j
        (second, denominator2), (third, denominator3) = self._solve_limb(c, s, 1, lengths), self._solve_limb(c, s, 2, lengths)
        cc, ss, ci, cj, constant = self._distance_coefficients(1, 2, lengths)
        total = np.ones_like(z)
        for c2, s2 in second:
            for c3, s3 in third:
                total = total * (cc * c2 * c3 + ss * s2 * s3 + ci * c2 * denominator3 + cj * c3 * denominator2
                                 + constant * denominator2 * denominator3)
        return total / (denominator2 * denominator3) ** 2

    def _complete_angles(self, angle: float, lengths: FloatArray) -> list[FloatArray]:
        """Return the angles of all limbs for that of the first, where the third equation holds, polished."""
        c, s = np.array([np.cos(angle)]).astype(complex), np.array([np.sin(angle)]).astype(complex)
        (second, denominator2), (third, denominator3) = self._solve_limb(c, s, 1, lengths), self._solve_limb(c, s, 2, lengths)
        result = []
        for c2, s2 in second:
            for c3, s3 in third:
                start = np.array([angle, *np.angle((c2 + 1j * s2) / denominator2), *np.angle((c3 + 1j * s3) / denominator3)])
                polished = self._polish(start, lengths)
                if polished is not None:
                    result.append(polished)
        return result

    def _polish(self, angles: FloatArray, lengths: FloatArray) -> FloatArray | None:
        for _ in range(8):
            value, slope = self._equations(angles, lengths)
            # At a singular pose Newton's step leads anywhere: the root as the polynomial gave it is dropped instead.
            if abs(np.linalg.det(slope)) < 1e-14 * np.abs(slope).max() ** 3:
                break
            step = np.linalg.solve(slope, -value)
            if np.abs(step).max() > 0.05:
                return None
            angles = angles + step
        return angles if np.abs(self._equations(angles, lengths)[0]).max() < 1e-10 * self.platform**2 else None

    def _equations(self, angles: FloatArray, lengths: FloatArray) -> tuple[FloatArray, FloatArray]:
        c, s = np.cos(angles), np.sin(angles)
        value, slope = np.empty(3), np.zeros((3, 3))
        for row, (i, j) in enumerate(((0, 1), (1, 2), (2, 0))):
            cc, ss, ci, cj, constant = self._distance_coefficients(i, j, lengths)
            value[row] = cc * c[i] * c[j] + ss * s[i] * s[j] + ci * c[i] + cj * c[j] + constant
            slope[row, i] = -s[i] * (cc * c[j] + ci) + ss * c[i] * s[j]
            slope[row, j] = -s[j] * (cc * c[i] + cj) + ss * s[i] * c[j]
        return value, slope

    def _pose(self, angles: FloatArray, lengths: FloatArray) -> FloatArray | None:
        """Return the pose of the platform on the ends of the limbs, None where it hangs below the base."""
        ends = (self.base - lengths * np.cos(angles))[:, None] * _RADIAL
        ends[:, 2] = lengths * np.sin(angles)
        centre = ends.mean(axis=0)
        normal = np.cross(ends[1] - ends[0], ends[2] - ends[0])
        normal /= np.linalg.norm(normal)
        if centre[2] <= 0:
            return None
        horizontal = float(np.hypot(normal[0], normal[1]))
        azimuth = float(np.arctan2(normal[1], normal[0])) if horizontal > 1e-9 else 0.0
        return np.array([centre[2], np.arctan2(horizontal, normal[2]), azimuth])


def _select_distinct(poses: list[FloatArray]) -> list[FloatArray]:
    kept: list[FloatArray] = []
    for pose in sorted(poses, key=lambda p: -p[0]):
        # Double roots of the polynomial come as two that agree to half of the digits.
        if not any(np.abs(pose - other).max() < 1e-7 for other in kept):
            kept.append(pose)
    return kept
