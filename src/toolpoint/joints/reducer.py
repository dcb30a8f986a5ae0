r"""Reducers (strain wave and other robot gears): torsion in straight pieces with lost motion and hysteresis, two bending
springs.

The twist of the output with the motor held follows the torque along straight pieces of slope K_1, K_2 ... between torques T_1,
T_2 ..., as catalogues state them; within the lost motion the slope is lower. Friction between the teeth is one elastic slider
beside it (Masing): the loop is as wide at no torque as the catalogue's hysteresis loss. Small vibration about a load sees the
slope there.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import Array, FloatArray, fail, floats, nonnegative, scalar, suggestion
from toolpoint._notebook import NotebookText
from toolpoint._quantity import Quantity, limit_faults
from toolpoint.joints.linear import LinearJoint, linear

TorsionStiffness = Annotated[float, Quantity("rotational stiffness", "N*m/rad", above=0)]
PositiveTorque = Annotated[float, Quantity("moment", "N*m", above=0)]
TorsionDamping = Annotated[float, Quantity("rotational damping", "N*m*s/rad", least=0)]
Twist = Annotated[float, Quantity("angle", "rad", least=0)]
ReducerMass = Annotated[float, Quantity("mass", "kg", above=0)]
ReducerDiameter = Annotated[float, Quantity("length", "m", above=0)]
_SAMPLES_PER_CYCLE = 720  # of the loop's first harmonic


@dataclass(frozen=True)
class Reducer(NotebookText):
    """Reducer as a catalogue states it.

    Parameters
    ----------
    ratio : float
        Turns of the motor for one of the output, at least 1.
    torsion : tuple of floats
        Slopes K_1, K_2 ..., N m/rad, one or several.
    torques : tuple of floats
        Torques T_1, T_2 ... where one slope gives way to the next, N m, one fewer than slopes.
    bending : float
        N m/rad about each axis across the output.
    damping, bending_damping : float
        N m s/rad.
    mass, diameter : float, optional
        kg, m.
    lost_motion, lost_motion_torque : float
        Twist (rad) between plus and minus that torque (N m); both or neither.
    hysteresis : float
        Width of the loop at zero torque, rad.
    settling : float
        Twist over which friction builds up after a reversal, rad; a quarter of the width where zero.
    series : str
        Word that reducers of one size and kind share, told apart by their ratios.

    Raises
    ------
    ToolpointError
        For a number that is missing or outside its limits, or torques that do not fit the slopes.

    Examples
    --------
    >>> from toolpoint.joints import Reducer
    >>> reducer = Reducer(100.0, torsion=(1e4, 2e4), torques=(50.0,), bending=1e5)
    >>> float(reducer.twist(100.0).round(6))  # 50 N m on the first slope, 50 N m on the second
    0.0075
    """

    ratio: float
    torsion: tuple[TorsionStiffness, ...] = ()
    torques: tuple[PositiveTorque, ...] = ()
    bending: TorsionStiffness | None = None
    damping: TorsionDamping = 0.0
    bending_damping: TorsionDamping = 0.0
    mass: ReducerMass | None = None
    diameter: ReducerDiameter | None = None
    lost_motion: Twist = 0.0
    lost_motion_torque: Annotated[float, Quantity("moment", "N*m", least=0)] = 0.0
    hysteresis: Twist = 0.0
    settling: Twist = 0.0
    series: str = ""
    source: str = ""

    def __post_init__(self) -> None:
        if not np.isfinite(self.ratio) or self.ratio < 1:
            fail("Reducer.ratio", f"{self.ratio:g}", "must be at least 1: turns of the motor for one of the output")
        if not self.torsion or self.bending is None:
            fail("Reducer." + ("torsion" if not self.torsion else "bending"), "missing",
                 "a reducer needs its stiffness, N m/rad",
                 remedy="take it from the catalogue, or choose the next one that states it")
        for key, text in limit_faults(self):
            fail("Reducer." + ".".join(map(str, key)), text, "see the catalogue")
        if len(self.torques) != len(self.torsion) - 1 or (np.diff(self.torques) <= 0).any():
            fail("Reducer.torques", f"{len(self.torques)} for {len(self.torsion)} slopes", "must be one fewer, increasing",
                 remedy="T_1 is where K_1 gives way to K_2")
        if (self.lost_motion > 0) != (self.lost_motion_torque > 0):
            fail("Reducer.lost_motion", f"{self.lost_motion:g} rad at {self.lost_motion_torque:g} N m",
                 "both or neither are given",
                 remedy="catalogues state the twist between plus and minus a few per cent of the rated torque")
        if self.lost_motion_torque and self.torques and self.lost_motion_torque >= self.torques[0]:
            fail("Reducer.lost_motion_torque", f"{self.lost_motion_torque:g} N m",
                 f"must be below T_1 = {self.torques[0]:g} N m")

    def _pieces(self) -> tuple[FloatArray, FloatArray]:
        """Return the torques where pieces end (the last infinite) and their slopes, upwards; lost motion is the first piece."""
        ends, slopes = [*self.torques, np.inf], list(self.torsion)
        if self.lost_motion > 0:
            ends, slopes = [self.lost_motion_torque, *ends], [2 * self.lost_motion_torque / self.lost_motion, *slopes]
        return np.array(ends), np.array(slopes)

    @property
    def has_slopes(self) -> bool:
        """Whether its torsional stiffness depends on the load."""
        return len(self.torsion) > 1 or self.lost_motion > 0

    def twist(self, torque: ArrayLike) -> FloatArray:
        """Return the twist of the output at torques, rad, on the middle line of the hysteresis loop."""
        torques = floats("torque", torque)
        ends, slopes = self._pieces()
        starts = np.concatenate([[0.0], ends[:-1]])
        twists = np.clip(np.abs(torques)[..., None] - starts, 0.0, ends - starts) / slopes
        return np.sign(torques) * twists.sum(axis=-1)

    def torque(self, twist: ArrayLike) -> FloatArray:
        """Return the torque at twists (rad), N m, on the middle line."""
        twists = floats("twist", twist)
        ends, slopes = self._pieces()
        starts = np.concatenate([[0.0], ends[:-1]])
        widths = (ends - starts) / slopes
        twist_starts = np.concatenate([[0.0], np.cumsum(widths[:-1])])
        return np.sign(twists) * (np.clip(np.abs(twists)[..., None] - twist_starts, 0.0, widths) * slopes).sum(axis=-1)

    @property
    def friction(self) -> float:
        """Torque of the slider, N m: it opens the loop to the hysteresis at no torque."""
        return float(self.torque(self.hysteresis / 2))

    def history(self, twist: ArrayLike) -> FloatArray:
        """Return the torque over a history of twists (n,), N m: middle line and slider, the slider at rest before the first."""
        twists = floats("twist", twist, (None,))
        slider_limit = self.friction
        if slider_limit == 0:
            return self.torque(twists)
        stiffness = slider_limit / (self.settling or self.hysteresis / 4)
        slider = np.zeros(twists.size)
        for sample in range(1, twists.size):
            # Elastic slider (Masing): its torque follows the twist and stops at the friction.
            slider[sample] = min(max(slider[sample - 1] + stiffness * (twists[sample] - twists[sample - 1]), -slider_limit),
                                 slider_limit)
        return self.torque(twists) + slider

    def linearise(self, load: float = 0.0, amplitude: float = 0.0) -> LinearTorsion:
        r"""Return stiffness and loss of small vibration about a load.

        Without an amplitude it is the slope of the middle line; with one (rad) the first harmonic of the loop:
        :math:`k = \frac{1}{\pi a}\oint T \cos\theta\,d\theta`, the loss modulus likewise with the sine.

        Parameters
        ----------
        load : float
            N m.
        amplitude : float
            rad, of the twist about that at the load.
        """
        torque, twist_amplitude = scalar("load", load), scalar("amplitude", amplitude)
        nonnegative("amplitude", np.array(twist_amplitude))
        mean_twist = float(self.twist(torque))
        if twist_amplitude == 0:
            ends, slopes = self._pieces()
            return LinearTorsion(float(slopes[int(np.searchsorted(ends, abs(torque), side="left"))]), 0.0, mean_twist)
        phases = np.arange(2 * _SAMPLES_PER_CYCLE + 1) * (2 * np.pi / _SAMPLES_PER_CYCLE)
        # Two cycles: the first brings the slider from rest onto its closed loop, the second is analysed.
        torques = self.history(mean_twist + twist_amplitude * np.cos(phases))[_SAMPLES_PER_CYCLE:-1]
        angles = phases[:_SAMPLES_PER_CYCLE]
        stiffness = 2 / (_SAMPLES_PER_CYCLE * twist_amplitude) * float(torques @ np.cos(angles))
        return LinearTorsion(stiffness, max(-2 / (_SAMPLES_PER_CYCLE * twist_amplitude) * float(torques @ np.sin(angles)),
                                            0.0), mean_twist)

    def joint(self, load: float = 0.0, amplitude: float = 0.0) -> LinearJoint:
        """Return the joint between the body that carries the motor and the one that is driven, its z along the output's axis.

        Torsion and two bending springs with viscous damping; translations are locked.
        """
        torsion = self.linearise(load, amplitude)
        assert self.bending is not None
        dampers = {"rx": self.bending_damping, "ry": self.bending_damping, "rz": self.damping}
        loss = {"rz": torsion.loss / torsion.stiffness} if torsion.loss else 0.0
        return linear({"rx": self.bending, "ry": self.bending, "rz": torsion.stiffness},
                      {direction: value for direction, value in dampers.items() if value > 0}, loss)

    def __repr__(self) -> str:
        slopes = ", ".join(f"{k:.4g}" for k in self.torsion)
        return f"Reducer(1:{self.ratio:g}, torsion {slopes} N m/rad, bending {self.bending:.4g} N m/rad)"


@dataclass(frozen=True)
class LinearTorsion:
    """Torsion about a load: stiffness and loss modulus, N m/rad, and the twist at the load, rad.

    Examples
    --------
    >>> from toolpoint.joints import Reducer
    >>> Reducer(100.0, torsion=(1e4, 2e4), torques=(50.0,), bending=1e5).linearise(load=80.0)
    LinearTorsion(stiffness=20000.0, loss=0.0, twist=0.006500000000000001)
    """

    stiffness: float
    loss: float
    twist: float


def reflect_inertia(inertia: float, ratio: float) -> float:
    """Return a motor's inertia as the output feels it along its own rotation, J R^2, kg m^2.

    Examples
    --------
    >>> from toolpoint.joints import reflect_inertia
    >>> reflect_inertia(1e-4, 100.0)
    1.0
    """
    return float(nonnegative("inertia", np.array(scalar("inertia", inertia)))) * scalar("ratio", ratio) ** 2


def choose_reducer(catalogue: Mapping[str, Reducer], ratio: float, *, largest_diameter: float = np.inf,
                   smallest_diameter: float = 0.0) -> str:
    """Return the name of the reducer of a catalogue whose ratio is nearest (by its logarithm), among those of the size.

    Sizes in m. Raises ToolpointError where the catalogue holds none of the size.

    Examples
    --------
    >>> from toolpoint.joints import Reducer, choose_reducer
    >>> catalogue = {f"1:{ratio}": Reducer(ratio, torsion=(1e4,), bending=1e5) for ratio in (50, 80, 120)}
    >>> choose_reducer(catalogue, 100.0)
    '1:120'
    """
    candidates = {name: part for name, part in catalogue.items()
            if part.diameter is None or smallest_diameter <= part.diameter <= largest_diameter}
    if not candidates:
        fail("catalogue", f"no reducer of {1e3 * smallest_diameter:g} .. {1e3 * largest_diameter:g} mm",
             "must hold one that fits",
             remedy="add rows, or allow another size")
    log_distances: Array = np.abs(np.log([part.ratio / ratio for part in candidates.values()]))
    return list(candidates)[int(log_distances.argmin())]


def next_ratio(catalogue: Mapping[str, Reducer], name: str) -> str | None:
    """Return the reducer of the same series with the next higher ratio; None where the catalogue holds none.

    Examples
    --------
    >>> from toolpoint.joints import Reducer, next_ratio
    >>> catalogue = {f"1:{ratio}": Reducer(ratio, (1e4,), bending=1e5, series="A") for ratio in (50, 80, 120)}
    >>> next_ratio(catalogue, "1:50")
    '1:80'
    """
    reducer = reducer_of(catalogue, name)
    higher = [key for key, part in catalogue.items() if reducer.series and part.series == reducer.series
              and part.ratio > reducer.ratio]
    return min(higher, key=lambda key: catalogue[key].ratio) if higher else None


def reducer_of(catalogue: Mapping[str, Reducer], name: str) -> Reducer:
    """Return a reducer of a catalogue by name.

    Raises ToolpointError with the nearest name where there is none.

    Examples
    --------
    >>> from toolpoint.joints import Reducer, reducer_of
    >>> reducer_of({"small": Reducer(50.0, torsion=(1e4,), bending=1e5)}, "small")
    Reducer(1:50, torsion 1e+04 N m/rad, bending 1e+05 N m/rad)
    """
    if name not in catalogue:
        fail("reducer", f"no {name!r} in the catalogue", f"must be of {', '.join(catalogue) or 'none'}",
             remedy=suggestion(name, catalogue))
    return catalogue[name]
