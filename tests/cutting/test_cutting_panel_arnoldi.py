"""PanelArnoldi and Automatic: general tools, process damping, rounded edges, low speeds; against collocation and the laws."""

from __future__ import annotations

import numpy as np
import pytest

from cutting.cutting_cases import altintas, benchmark, random_problem
from toolpoint import Modes, ToolpointError
from toolpoint.cutting import (
    Collocation,
    CuttingCoefficients,
    Engagement,
    FloquetDeterminant,
    HillDeterminant,
    MillingProblem,
    PanelArnoldi,
    SpeedVariation,
    Tool,
    TurningProblem,
    ZeroOrder,
    stability,
)
from toolpoint.cutting.stability.automatic import Automatic, estimate_seconds
from toolpoint.cutting.stability.panels.bumps import Level, predict_meeting
from toolpoint.cutting.stability.panels.search import PanelSearch

SLOT = {0.2: 0.8197427843, 0.5: 1.0739755867, 0.7: 1.2215561357, 1.0: 1.4064735254}  # |mu|, depth in mm, 5000 rev/min


@pytest.mark.parametrize("depth", SLOT)
def test_multipliers_of_the_slot(depth: float) -> None:
    """The converged multipliers of the 1-DOF slot to 1e-8."""
    got = np.abs(PanelArnoldi().multipliers(benchmark(Engagement.slot()), 5000.0, 1e-3 * depth)[0])
    assert got == pytest.approx(SLOT[depth], abs=1e-8)


@pytest.mark.slow
def test_equal_pitch_reproduces_the_exact_engine() -> None:
    """Regular straight teeth: the limits of FloquetDeterminant, and the re-stable interval, to 1e-9."""
    speeds = [3000.0, 6000, 9500, 14000, 16000]
    exact = stability.chart(altintas(), speeds, FloquetDeterminant(tolerance=1e-9)).limit
    assert stability.chart(altintas(), speeds, PanelArnoldi()).limit == pytest.approx(exact, rel=1e-9)
    found = 1e3 * stability.chart(benchmark(Engagement.down(0.5)), [17500.0], PanelArnoldi()).intervals(0)
    assert found == pytest.approx(np.array([[0, 1.088426], [2.026046, 2.152617]]), abs=6e-7)


def test_pitch_that_becomes_equal() -> None:
    """Unequal pitch in the limit of equal: over a revolution the N-th power of the tooth period's multiplier, to 1e-9."""
    problem = altintas().changed(tool=Tool(0.0254, 4))
    nearly = problem.changed(tool=Tool(0.0254, 4, pitch=np.pi / 2 + 1e-9 * np.array([1, -1, 0.5, -0.5])))
    for speed, depth in ((5000.0, 0.6e-3), (12000.0, 1.2e-3)):
        regular = np.abs(PanelArnoldi(nodes=6).multipliers(problem, speed, depth)[0]) ** 4
        whole = np.abs(PanelArnoldi(nodes=6).multipliers(nearly, speed, depth)[0])
        assert whole == pytest.approx(regular, rel=1e-9)


def tool_of(kind: str, rng: np.random.Generator) -> Tool:
    """A tool without a single delay, a helical, or a rounded one."""
    n = int(rng.integers(2, 5))
    pitch = 2 * np.pi / n * (1 + 0.25 * rng.uniform(-1, 1, n))
    pitch *= 2 * np.pi / pitch.sum()
    return {"pitch": Tool(0.016, n, pitch=pitch), "helix": Tool(0.016, n, helix=0.6),
            "unequal helix": Tool(0.016, n, helix=rng.uniform(0.4, 0.7, n)),
            "both": Tool(0.016, n, pitch=pitch, helix=0.5), "corner": Tool(0.016, n, corner_radius=0.003),
            "ball": Tool(0.016, n, corner_radius=0.008), "straight": Tool(0.016, n)}[kind]


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["pitch", "helix", "unequal helix", "both", "corner", "ball", "straight"])
def test_boundary_is_one_of_converged_collocation(kind: str) -> None:
    """Random cuts: on the boundary collocation with many nodes has its largest multiplier on the unit circle; the growth
    it is off by, over the slope, lies within the stated error."""
    rng = np.random.default_rng(len(kind))
    checked = 0
    for _ in range(8):
        problem = random_problem(rng, modes=int(rng.integers(1, 4)), mu=1e6)
        if kind in ("corner", "ball"):  # elsewhere the arc of cut changes along the edge, which slices resolve slowly
            problem = problem.changed(engagement=(Engagement.slot(), Engagement.up(0.5))[int(rng.integers(0, 2))])
        damping = 2e4 if kind == "straight" else 0.0
        problem = problem.changed(tool=tool_of(kind, rng), process_damping=damping)
        speed = float(rng.uniform(5000, 15000))
        chart = stability.chart(problem, [speed], PanelArnoldi(), depth_max=0.008)
        p = chart.limit_points()[0]
        if p < 0:
            continue
        slices = 1 if kind in ("pitch", "straight") else 12
        general = Collocation(nodes=8, slices=slices)
        w = chart.limit[0]
        growth = [np.log(np.abs(general.multipliers(problem, speed, w * f)[0])) for f in (1, 1.0005)]
        true = w - growth[0] * 0.0005 * w / (growth[1] - growth[0])
        # The slices of the collocation have an error of their own, falling with their fourth power.
        assert abs(true - w) <= chart.error[p] + (1e-9 if slices == 1 else 1.5e-4) * w
        checked += 1
        if checked == (3 if slices == 1 else 1 if "unequal" in kind or kind == "both" else 2):
            return
    assert checked


def test_helix_of_one_axial_pitch_makes_the_single_frequency_solution_exact() -> None:
    """With depth = pi D/(N tan helix) the coefficient is constant: the zero-order limit has a multiplier on the circle."""
    problem = benchmark(Engagement.down(0.3), 2)
    limit = stability.chart(problem, [9000.0], ZeroOrder(), depth_max=0.002).limit[0]
    tool = Tool(0.02, 2)
    # An angle beyond any real tool's, but the law holds for it.
    object.__setattr__(tool, "helix", np.full(2, np.arctan(np.pi * 0.02 / (2 * limit))))
    mu = PanelArnoldi(nodes=6).multipliers(problem.changed(tool=tool), 9000.0, limit)[0]
    assert abs(mu) == pytest.approx(1, abs=1e-9)
    chart = stability.chart(problem.changed(tool=tool), [9000.0], depth_max=1.3 * limit)
    assert chart.method == "PanelArnoldi" and np.abs(chart.depth / limit - 1).min() < 1e-9


@pytest.mark.parametrize("tool", [Tool(0.016, 3, pitch=[1.9, 2.2, 2 * np.pi - 4.1]), Tool(0.016, 3, helix=0.5),
                                  pytest.param(Tool(0.016, 3, helix=[0.4, 0.5, 0.6]), marks=pytest.mark.slow),
                                  Tool(0.016, 2, corner_radius=0.005, helix=0.4)])
@pytest.mark.default_cases(1)
def test_laws_of_symmetry(tool: Tool) -> None:
    """General tools: structure and feed turned together about z, and up milling of the mirrored structure (teeth in the other
    order) give the same limits to 1e-9."""
    rng = np.random.default_rng(3)
    problem = random_problem(rng, modes=3, mu=1e6).changed(tool=tool, engagement=Engagement(0.7, 2.1))
    modes = problem.dynamics
    limit = stability.chart(problem, [7000.0], depth_max=0.008).limit
    assert np.isfinite(limit).all()
    c, s = np.cos(0.7), np.sin(0.7)
    turned = Modes(modes.frequency, modes.damping_ratio, [[c, -s], [s, c]] @ np.asarray(modes.shape),
                   modes.dofs)  # type: ignore
    again = stability.chart(problem.changed(dynamics=turned, feed_angle=0.7), [7000.0], depth_max=0.008).limit
    assert again == pytest.approx(limit, rel=1e-9)
    half = problem.at_feed_angle(np.pi)
    flipped = Modes(modes.frequency, modes.damping_ratio, -np.asarray(modes.shape), modes.dofs)  # type: ignore[union-attr]
    assert stability.chart(half, [7000.0], depth_max=0.008).limit == pytest.approx(
        stability.chart(problem.changed(dynamics=flipped), [7000.0], depth_max=0.008).limit, rel=1e-9)


def test_a_small_corner_changes_nothing_and_a_large_one_does() -> None:
    """The limit of a corner radius that vanishes is the sharp tool's; a ball's differs, and it takes depth as it is."""
    problem = altintas()
    speeds = [9500.0, 14000.0]
    sharp = stability.chart(problem, speeds, PanelArnoldi()).limit
    tiny = stability.chart(problem.changed(tool=Tool(0.0254, 2, corner_radius=1e-10)), speeds).limit
    ball = stability.chart(problem.changed(tool=Tool(0.0254, 2, corner_radius=0.0127)), speeds)
    assert tiny == pytest.approx(sharp, rel=1e-6)
    assert ball.method == "PanelArnoldi" and (np.abs(ball.limit / sharp - 1) > 0.005).all()


def test_speed_variation_as_in_collocation() -> None:
    """Sinusoidal speed variation: the boundary is collocation's."""
    problem = altintas().changed(speed_variation=SpeedVariation(0.1, 1))
    chart = stability.chart(problem, [6000.0])
    assert chart.method == "PanelArnoldi"
    assert np.abs(Collocation().multipliers(problem, 6000.0, chart.limit[0])[0]) == pytest.approx(1, abs=1e-8)


def test_verdicts_are_those_of_the_exact_engine() -> None:
    """Random cuts of 1-20 modes, 100 depths each: no pixel differs outside the stated errors."""
    rng = np.random.default_rng(4)
    depths = np.linspace(1e-4, 0.01, 100)
    for _ in range(12):
        problem, speeds = random_problem(rng), rng.uniform(6000, 15000, 2)
        exact = stability.chart(problem, speeds, FloquetDeterminant())
        fast = stability.chart(problem, speeds, PanelArnoldi())
        wrong = (exact.stable(depths) != fast.stable(depths)) & ~exact.uncertain(depths) & ~fast.uncertain(depths)
        assert not wrong.any()


def test_low_speeds_of_many_modes() -> None:
    """18 modes, a slot with four teeth (constant matrix): at every speed the default gives the zero-order limit, which is
    exact there, whichever engine it takes; one chart holds both."""
    rng = np.random.default_rng(0)
    f = np.sort(rng.uniform(30, 1500, 18))
    angle, k = rng.uniform(0, np.pi, 18), 2.5e7 * rng.uniform(1, 20, 18)
    shape = 2 * np.pi * f / np.sqrt(k) * np.stack([np.cos(angle), np.sin(angle)])
    problem = benchmark(Engagement.slot(), 2, tool=Tool(0.02, 4)).changed(
        dynamics=Modes(f, rng.uniform(0.01, 0.05, 18), shape, ("tool:+x", "tool:+y")))
    speeds = np.array([300.0, 1000, 3000, 24000, 8000, 11222])
    chart = stability.chart(problem, speeds, depth_max=0.03)
    assert chart.method == "FloquetDeterminant, PanelArnoldi"
    single = stability.chart(problem, speeds, ZeroOrder(), depth_max=0.03).limit
    assert chart.limit == pytest.approx(single, rel=1e-7)
    assert estimate_seconds(problem, 300.0) > Automatic().patience > estimate_seconds(problem, 24000.0)


def test_a_speed_the_determinant_refuses_is_solved() -> None:
    """100 rev/min, a slot with four teeth: the zero-order limit, exact there; depths beyond double precision are marked."""
    problem = benchmark(Engagement.slot(), 2, tool=Tool(0.02, 4))
    single = stability.chart(problem, [100.0], ZeroOrder(), depth_max=2e-4).limit
    assert stability.chart(problem, [100.0], depth_max=2e-4).limit == pytest.approx(single, rel=1e-6)
    deep = stability.chart(problem, [100.0], depth_max=0.5)
    assert "double precision" in deep.status and not deep.stable([0.5])[0, 0]
    assert deep.limit == pytest.approx(single, rel=1e-6)


def test_nothing_in_cut_is_stable() -> None:
    """A ball whose tip stays beyond the wall does not cut: stable, with the structure's own multipliers."""
    problem = altintas().changed(tool=Tool(0.0254, 2, corner_radius=0.0127), engagement=Engagement.down(0.05))
    assert np.isinf(stability.chart(problem, [6000.0], depth_max=1e-4).limit[0])
    mu = PanelArnoldi().multipliers(problem, 6000.0, 1e-4)
    own = np.exp(problem.plane.poles * float(problem.tooth_period(6000.0)))
    assert np.sort(np.abs(mu)) == pytest.approx(np.sort(np.abs(own)))


def test_what_it_cannot_do_is_refused() -> None:
    """Turning and nonsense settings."""
    turning = TurningProblem(1e9, benchmark(Engagement.slot()).dynamics)  # type: ignore[arg-type]
    with pytest.raises(ToolpointError, match="ZeroOrder"):
        stability.chart(turning, [5000.0], PanelArnoldi())
    with pytest.raises(ToolpointError, match="nodes"):
        PanelArnoldi(nodes=1)
    assert isinstance(altintas(), MillingProblem)


def test_speed_dependent_response() -> None:
    """A response that is a function of the speed gives at each speed what the fixed response gives, for uneven pitch too."""
    problem = benchmark(Engagement.down(0.3), 2, tool=Tool(0.02, 3, pitch=[1.9, 2.2, 2 * np.pi - 4.1]))
    modes = problem.dynamics

    def at(speed: float) -> Modes:
        return modes if speed < 8000 else modes.with_damping(0.03)  # type: ignore

    mixed = stability.chart(problem.changed(dynamics=at), [7000.0, 9000.0], depth_max=0.005).limit
    fixed = [stability.chart(problem.changed(dynamics=at(n)), [n], depth_max=0.005).limit[0] for n in (7000.0, 9000.0)]
    assert np.isfinite(mixed).all() and mixed == pytest.approx(fixed, rel=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 7, 14, 22])
def test_walls_that_clip_a_rounded_tip(seed: int) -> None:
    """Corner radius and ball, straight and helical, arcs that do not reach the axis: the walls bound the edge from some height
    on, entries and exits turn back along it. Hill's determinant, another method throughout, agrees within the stated errors."""
    rng = np.random.default_rng(seed)
    problem = random_problem(rng, modes=2, mu=1e6)
    teeth, entry = int(rng.integers(2, 5)), rng.uniform(0.1, 1.5)
    arc = Engagement(entry, rng.uniform(max(entry + 0.3, 1.65), 3.0))
    tool = Tool(0.016, teeth, corner_radius=0.008 if seed % 3 else 0.004, helix=(0.0, 0.5, 0.6)[seed % 3])
    problem = problem.changed(tool=tool, engagement=arc)
    speed = [float(rng.uniform(5000, 12000))]
    panel = stability.chart(problem, speed, PanelArnoldi(), depth_max=0.008)
    hill = stability.chart(problem, speed, HillDeterminant(reach=4.0), depth_max=0.008)
    error = panel.error[panel.limit_points()[0]] + hill.error[hill.limit_points()[0]]
    assert abs(panel.limit[0] - hill.limit[0]) <= error < 2e-5 * panel.limit[0]


def island() -> tuple[MillingProblem, float]:
    """One mode, four teeth of unequal pitch: a fold lobe from 0.52 to 0.65 mm, below the Hopf lobe that begins at 0.73 mm."""
    angle, hz, stiffness = 1.67018914, 1006.2158630, 2.7370912586e6
    shape = 2 * np.pi * hz / np.sqrt(stiffness) * np.array([[np.cos(angle)], [np.sin(angle)]])
    pitch = np.array([1.45621426, 1.69770354, 1.84939861])
    tool = Tool(0.016, 4, pitch=[*pitch, 2 * np.pi - pitch.sum()])
    modes = Modes([hz], [0.01729845], shape, ("tool:+x", "tool:+y"))
    arc = Engagement(np.radians(135.1), np.radians(175.4))
    return MillingProblem(tool, arc, CuttingCoefficients(1768.47e6, 714.579e6), modes), 9024.6


def test_a_lobe_between_two_search_levels() -> None:
    """A pair of multipliers meets on the real axis between two levels, one leaves the circle and comes back: all is found."""
    problem, speed = island()
    chart = stability.chart(problem, [speed], PanelArnoldi(), depth_max=0.008)
    assert chart.kind[:3] == ("fold", "fold", "Hopf")
    hill = stability.chart(problem, [speed], HillDeterminant(reach=4.0), depth_max=0.008)
    assert chart.intervals(0) == pytest.approx(hill.intervals(0), rel=1e-4)
    general = Collocation(nodes=8)
    for depth in np.linspace(0.4e-3, 0.8e-3, 12):
        assert chart.stable([depth])[0, 0] == (np.abs(general.multipliers(problem, speed, depth)[0]) < 1)


def test_mean_and_cosine_pass_through_a_meeting() -> None:
    """x^2 - 2 c x + 1 times e^m: one (m, c) before and after the meeting, the growth from them is that of the roots."""
    for cosine in (-1.3, -1.0001, -0.7, 0.2, 0.999, 1.2):
        roots = np.roots([1, -2 * cosine, 1]).astype(complex) * np.exp(-0.3)
        values = np.array([*roots[np.argsort(-np.abs(roots))], 0.01 + 0.02j, 0.01 - 0.02j])
        level = Level.of(1e-3, values)
        assert (level.mean, level.cosine) == pytest.approx((-0.3, cosine), abs=1e-9)
        assert level.growth == pytest.approx(-0.3 + np.arccosh(max(1, abs(cosine))))
    assert np.isnan(Level.of(1e-3, np.array([0.9, 0.1 + 0.2j, 0.1 - 0.2j])).mean)


def test_where_a_bump_is_looked_for() -> None:
    """Cosines that rise towards 1 from both sides: between them. Cosines that stay away from it, and far growths: nowhere."""
    levels = [Level(w, -0.2, -0.2, c) for w, c in ((1.0, 0.6), (2.0, 0.98), (3.0, 0.95), (4.0, 0.5))]
    place = predict_meeting(tuple(levels))
    assert place is not None and 2 < place < 3
    assert predict_meeting(tuple(Level(one.depth, -5.0, -5.0, one.cosine) for one in levels)) is None
    assert predict_meeting(tuple(Level(one.depth, one.growth, one.mean, 0.3 * one.cosine) for one in levels)) is None
    assert predict_meeting((None, *levels[1:3], None)) is None
    unstable = [Level(w, 0.3, -0.2, c) for w, c in ((1.0, 1.9), (2.0, 1.2), (3.0, 1.2), (4.0, 1.9))]
    assert predict_meeting(tuple(unstable)) is not None  # two real multipliers that are about to meet and to fall back inside


@pytest.mark.slow
@pytest.mark.parametrize("reach", [2.0, 4.0])
def test_two_flips_close_to_each_other(reach: float) -> None:
    """Two multipliers pass through -1 between two levels of Hill's determinant: each is a flip of its own."""
    rng = np.random.default_rng(54)
    problem = random_problem(rng, modes=2, mu=1e6)
    teeth, entry = int(rng.integers(2, 5)), rng.uniform(0.1, 1.5)
    arc = Engagement(entry, rng.uniform(max(entry + 0.3, 1.65), 3.0))
    problem = problem.changed(tool=Tool(0.016, teeth, corner_radius=0.004), engagement=arc)
    speed = float(rng.uniform(5000, 12000))
    hill = stability.chart(problem, [speed], HillDeterminant(reach=reach), depth_max=0.002)
    assert hill.kind[:2] == ("flip", "flip") and hill.change[:2].tolist() == [1, 1]
    panel = stability.chart(problem, [speed], PanelArnoldi(), depth_max=0.002)
    assert hill.limit == pytest.approx(panel.limit, rel=1e-6)


class Flickering:
    """A growth x - 1 whose ends are of the other sign when they are asked again, as rounding makes those of nearly nothing."""

    def __init__(self):
        self.asked = []

    def growth(self, depth, more=0):
        again = depth in self.asked and depth in (0.5, 2.0)
        self.asked.append(depth)
        return (1e-15 if again else depth - 1), 1.0 + 0j


def test_a_growth_of_nearly_nothing_that_changes_its_sign_ends_in_no_foreign_error():
    root, slope, _, is_root = PanelSearch._polish(Flickering(), 1.5, 0.0, 0, 0.5, 2.0)
    assert is_root and root == pytest.approx(1, rel=1e-9) and slope == pytest.approx(1, rel=1e-6)
