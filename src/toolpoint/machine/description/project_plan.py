"""Content of a project file as plain frozen data: tests, machine, cuts, goals, changes; every part may be missing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:  # as in the description of a machine
    from toolpoint.cutting.description import CuttingDescription

STRUCTURE, TIP_X, TIP_Y = "structure", "tip x", "tip y"
ASSUMED_COEFFICIENT_DEVIATION = 0.1  # relative standard deviation of cutting coefficients where none is given


@dataclass(frozen=True)
class ProjectTest:
    """Hammer test of a project: one of a test file, records, responses or modes; where and when it was made.

    test, records, responses, modes : files relative to the project; records and responses may be patterns (``tip_*.csv``).
    channels : as for `toolpoint frf --channel`; struck, pattern : where the names or the channels do not say it.
    of : ``structure`` (joints or an update come from it), ``tip x`` or ``tip y`` (limits come from it directly).
    date : ISO, empty where not known; pose : m or rad; sensor_mass : kg, of a sensor that was moved; band : Hz.
    """

    test: str | None = None
    records: tuple[str, ...] = ()
    responses: tuple[str, ...] = ()
    modes: str | None = None
    channels: tuple[str, ...] = ()
    struck: str | None = None
    pattern: str | None = None
    of: Literal["structure", "tip x", "tip y"] = "structure"
    date: str = ""
    pose: Mapping[str, float] = field(default_factory=dict)
    sensor_mass: float | None = None
    band: tuple[float, float] | None = None


@dataclass(frozen=True)
class ProjectCut:
    """Cut of a project: tool, engagement and material, and how well its coefficients are known (relative standard deviation;
    None where nothing is said)."""

    cut: CuttingDescription
    coefficient_deviation: float | None = None


@dataclass(frozen=True)
class ProjectGoal:
    """Goal of a project: a cut at a speed (rev/min) and depth (m) at a pose."""

    speed: float
    depth: float
    cut: str = ""
    pose: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class ProjectChange:
    """Change that may be made: all springs of a joint, by a share of them; and its cost."""

    joint: str
    stiffness: float
    cost: float = 1.0


@dataclass(frozen=True)
class ContourGoal:
    """Circle that the servo must follow: radius (m), feed (m/s), largest radial deviation (m), its two axes."""

    radius: float
    feed: float
    deviation: float
    axes: tuple[str, str] = ("X", "Y")


@dataclass(frozen=True)
class ProjectDescription:
    """Content of a project file; paths are relative to the project, poses in m and rad.

    workspace : poses that limits are wanted at besides those of the goals; draws, seed : of the limits.
    """

    name: str
    tests: Mapping[str, ProjectTest] = field(default_factory=dict)
    machine: str | None = None
    components: str | None = None
    geometry: str | None = None
    servo: str | None = None
    cuts: Mapping[str, ProjectCut] = field(default_factory=dict)
    goals: Mapping[str, ProjectGoal] = field(default_factory=dict)
    contours: Mapping[str, ContourGoal] = field(default_factory=dict)
    changes: Mapping[str, ProjectChange] = field(default_factory=dict)
    workspace: tuple[Mapping[str, float], ...] = ()
    draws: int = 60
    seed: int = 1


@dataclass(frozen=True)
class TriedCut:
    """Cut that was tried: speed (rev/min), depth (m), whether it was stable, its chatter frequency (Hz) where it was heard."""

    speed: float
    depth: float
    stable: bool
    frequency: float | None = None
    cut: str = ""
    pose: Mapping[str, float] = field(default_factory=dict)
