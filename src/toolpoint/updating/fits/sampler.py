r"""Samples of the posterior, where its shape is asked for beyond Laplace's normal one (extra `bayes`: emcee).

The log-posterior is :math:`-(\|r(x)\|^2 + \|x/s\|^2)/2` within the bounds, flat where a parameter has no prior. Several
independent ensembles of walkers are run by the affine-invariant stretch move (Goodman, Weare, Comm. Appl. Math. Comput. Sci.
5 (2010) 65; Foreman-Mackey et al., PASP 125 (2013) 306) from the Laplace posterior of a fit. Convergence: the integrated
autocorrelation time, and the split :math:`\hat R` between the halves of the ensembles (Gelman, Rubin, Stat. Sci. 7 (1992) 457),
which walkers of one ensemble cannot give because they are not independent.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, ToolpointError, count, fail
from toolpoint._doubt import Doubt
from toolpoint._notebook import NotebookText
from toolpoint.updating.fits.parameter_fit import ParameterFit
from toolpoint.updating.problem import Problem

STEPS_PER_CHUNK = 25  # of one ensemble before the next: what an interruption can lose
MIN_AUTOCORRELATION_TIMES = 50.0  # as emcee asks: a shorter chain underestimates the time itself, and so its own error
MAX_R_HAT = 1.05  # means of halves and ensembles then scatter by a third of the posterior: 1.05^2 - 1 = 0.1 in variance


@dataclass(frozen=True, eq=False)
class Samples(NotebookText):
    """Samples of the posterior.

    names : free parameters; x : (n_samples, n) coordinates after the burn-in; values : (n_samples, n), SI; autocorrelation :
    (n,) integrated autocorrelation time in steps; r_hat : (n,); effective : (n,) number of independent samples; acceptance :
    share of accepted moves; steps : per walker, burn-in included; burn_in : steps left out; course : what was run, in words;
    doubts : why the samples may not be the posterior.
    """

    names: tuple[str, ...]
    x: FloatArray
    values: FloatArray
    autocorrelation: FloatArray
    r_hat: FloatArray
    acceptance: float
    steps: int
    burn_in: int
    course: str
    doubts: tuple[Doubt, ...] = ()

    @property
    def status(self) -> str:
        """Size of the run, and whether it converged."""
        return f"{self.course}; {'; '.join(self.doubts) or 'converged'}"

    @property
    def mean(self) -> FloatArray:
        """Mean of the coordinates, (n,)."""
        return np.asarray(self.x.mean(axis=0))

    @property
    def covariance(self) -> FloatArray:
        """Covariance of the coordinates, (n, n)."""
        return np.atleast_2d(np.cov(self.x, rowvar=False))

    @property
    def effective(self) -> FloatArray:
        """Number of independent samples that the ones at hand are worth, (n,)."""
        return len(self.x) / np.maximum(self.autocorrelation, 1.0)

    def interval(self, name: str, probability: float = 0.95) -> tuple[float, float]:
        """Return the central interval of a parameter, SI."""
        if name not in self.names:
            fail("name", repr(name), f"must be of {', '.join(self.names)}")
        lower, upper = np.quantile(self.values[:, self.names.index(name)], [(1 - probability) / 2, (1 + probability) / 2])
        return float(lower), float(upper)

    def table(self) -> str:
        """Return median, 95 % interval, autocorrelation time, R-hat and effective number of every parameter as text."""
        width = max(map(len, self.names))
        lines = [self.status, f"{'parameter':{width}}      median        2.5 %       97.5 %  autocorr.   R-hat  effective"]
        for j, name in enumerate(self.names):
            lower, upper = self.interval(name)
            lines.append(f"{name:{width}} {np.median(self.values[:, j]):11.5g}  {lower:11.5g}  {upper:11.5g} "
                         f"{self.autocorrelation[j]:10.1f} {self.r_hat[j]:7.4f} {self.effective[j]:10.0f}")
        return "\n".join(lines)

    def __repr__(self) -> str:
        return f"Samples({len(self.x)} of {len(self.names)} parameters, {self.status})"


def sample(
    problem: Problem, start: ParameterFit, rng: np.random.Generator, *, steps: int = 2000, walkers: int | None = None,
    ensembles: int = 2, folder: str | Path | None = None, progress: Callable[[int, int], None] | None = None,
) -> Samples:
    """Return samples of the posterior of the parameters that a fit has moved.

    Parameters
    ----------
    problem, start : Problem, Fit
        Every free parameter needs a prior or two finite bounds.
    rng : numpy.random.Generator
    steps : int
        Per walker and ensemble.
    walkers : int, optional
        Even, at least twice the parameters; four times them where left out.
    ensembles : int
        Independent ones, at least two: what they differ by is R-hat.
    folder : path, optional
        What is finished is kept here, and a repeated call goes on from there (with the same parameters, data and walkers).
    progress : callable, optional
        Called with (steps done, steps in all) every few steps.

    Raises
    ------
    ToolpointError
        Where emcee is missing, a posterior is improper, or a folder holds other samples.

    An interruption from the keyboard ends the sampling and returns what there is; its status says so.
    """
    columns = [problem.names.index(n) for n in start.free]
    walkers = 4 * len(columns) if walkers is None else count("walkers", walkers, 2 * len(columns))
    _check(problem, columns, walkers, count("ensembles", ensembles, 2))
    density = _Density(problem, columns, start.x)
    runs = [_Run(density, start, rng, walkers, None if folder is None else Path(folder) / f"ensemble{k + 1}.npz")
            for k in range(ensembles)]
    interrupted = False
    try:
        for finished in _alternating(runs, count("steps", steps)):
            if progress is not None:
                progress(finished, ensembles * steps)
    except KeyboardInterrupt:
        if min(run.chain.shape[0] for run in runs) < 2 * STEPS_PER_CHUNK:
            raise
        interrupted = True
    return _judged(problem, columns, start.x, runs, interrupted)


class _Density:
    """The log-posterior of the free coordinates."""

    def __init__(self, problem: Problem, columns: list[int], x0: FloatArray) -> None:
        self.problem, self.columns, self.x0 = problem, columns, np.array(x0)
        lower, upper = problem.bounds
        self.lower, self.upper = lower[columns], upper[columns]
        self.precision = np.array([1 / p.prior**2 if (p := problem.parameters[j]).prior else 0.0 for j in columns])

    def __call__(self, free: FloatArray) -> float:
        # Before the model is asked: walkers step over bounds often, and the model may not exist there.
        if (free < self.lower).any() or (free > self.upper).any():
            return -np.inf
        x = self.x0.copy()
        x[self.columns] = free
        try:
            residual = self.problem.evaluated(x).values
        except ToolpointError:
            # Where the model does not exist (no stable equilibrium) the posterior is zero.
            return -np.inf
        return -0.5 * float(residual @ residual + self.precision @ free**2)


class _Run:
    """One ensemble: its chain (steps, walkers, n), kept in a file of plain arrays where a path is given."""

    def __init__(self, density: _Density, start: ParameterFit, rng: np.random.Generator, walkers: int,
                 path: Path | None) -> None:
        self.path, n = path, len(density.columns)
        self.sampler = _emcee().EnsembleSampler(walkers, n, density)
        # emcee draws from a generator of the old kind.
        self.sampler.random_state = np.random.RandomState(int(rng.integers(2**32))).get_state()
        centre = start.x[density.columns]
        # Walkers on one line would never leave it: the stretch move goes along differences of walkers alone.
        spread = np.linalg.cholesky(start.covariance + 1e-12 * np.trace(start.covariance) * np.eye(n))
        self.state: Any = np.clip(centre + rng.normal(size=(walkers, n)) @ spread.T, density.lower, density.upper)
        self.chain, self.accepted = np.zeros((0, walkers, n)), 0.0
        # The start and its density stand for problem and data: other ones in the folder are not gone on with.
        self.mark = np.concatenate([centre, [density(centre)]])
        if path is not None and path.exists():
            self._resume(path)

    def _resume(self, path: Path) -> None:
        """Go on from a chain on disk; one of another start or density is refused."""
        with np.load(path, allow_pickle=False) as kept:
            equal_lengths = kept["chain"].shape[1:] == self.chain.shape[1:]
            if not equal_lengths or not np.allclose(kept["mark"], self.mark, rtol=1e-6, atol=1e-9):
                fail("folder", f"{path} holds samples of another problem", "must be of this one", remedy="use an empty folder")
            self.chain, self.accepted = kept["chain"], float(kept["accepted"])
            state = kept["state"]
            self.sampler.random_state = ("MT19937", kept["keys"], int(state[0]), int(state[1]), float(state[2]))
        self.state = self.chain[-1]

    def advanced(self, steps: int) -> None:
        """Take more steps and keep them."""
        self.sampler.reset()
        self.state = self.sampler.run_mcmc(self.state, steps, skip_initial_state_check=True)
        self.chain = np.concatenate([self.chain, self.sampler.get_chain()])
        self.accepted += float(self.sampler.acceptance_fraction.mean()) * steps
        if self.path is not None:
            self._save(self.path)

    def _save(self, path: Path) -> None:
        """Write chain and generator beside the old file and exchange them: a kill leaves one of the two whole."""
        path.parent.mkdir(parents=True, exist_ok=True)
        _, keys, *remaining = self.sampler.random_state
        with tempfile.NamedTemporaryFile(dir=path.parent, suffix=".tmp", delete=False) as file:
            np.savez(file, chain=self.chain, accepted=self.accepted, mark=self.mark, keys=keys,
                     state=np.array(remaining, float))
        Path(file.name).replace(path)


def _alternating(runs: list[_Run], steps: int) -> Iterator[int]:
    """Advance the ensembles in turn, so that an interruption leaves them equally long; yield the steps done in all."""
    for upto in [*range(STEPS_PER_CHUNK, steps, STEPS_PER_CHUNK), steps]:
        for run in runs:
            if run.chain.shape[0] < upto:
                run.advanced(upto - run.chain.shape[0])
            yield sum(min(r.chain.shape[0], steps) for r in runs)


def _judged(problem: Problem, columns: list[int], x0: FloatArray, runs: list[_Run], interrupted: bool) -> Samples:
    """Return the samples after the burn-in, with doubts where the chains have not converged."""
    length = min(run.chain.shape[0] for run in runs)
    chains = np.stack([run.chain[:length] for run in runs])
    tau = _autocorrelation(chains)
    # Five autocorrelation times forget the start to below 1 %; half of a chain that is shorter is kept, and marked.
    burn = min(int(5 * tau.max()) + 1, length // 2)
    kept = chains[:, burn:]
    r_hat = _split_r_hat(kept)
    x = kept.reshape(-1, len(columns))
    values = np.stack([[problem.parameters[j].at(float(v)) for v in x[:, k]] for k, j in enumerate(columns)], axis=1)
    course = (f"{length} steps of {chains.shape[2]} walkers in {len(runs)} ensembles, {burn} left out as burn-in, R-hat up to "
              f"{r_hat.max():.3f}, autocorrelation time up to {tau.max():.0f} steps")
    doubts = [Doubt("samples", "interrupted", "call again with the same folder to go on")] if interrupted else []
    if length < MIN_AUTOCORRELATION_TIMES * tau.max() or r_hat.max() > MAX_R_HAT:
        doubts.append(Doubt(
            "samples", f"NOT converged (wanted: R-hat below {MAX_R_HAT:g} and at least {MIN_AUTOCORRELATION_TIMES:.0f} "
            "autocorrelation times)",
            f"take {int(np.ceil(MIN_AUTOCORRELATION_TIMES * tau.max() / 100)) * 100} steps or more",
            figure=float(r_hat.max()) - 1))
    if problem.assumed:
        course += "; standard deviations of the data are assumptions, and so is the width of the posterior"
    accepted = float(np.mean([run.accepted / run.chain.shape[0] for run in runs]))
    names = tuple(problem.names[j] for j in columns)
    return Samples(names, x, values, tau, r_hat, accepted, length, burn, course, tuple(doubts))


def _autocorrelation(chains: FloatArray) -> FloatArray:
    """Return the integrated autocorrelation time of every parameter in steps, the mean over the ensembles."""
    estimate = _emcee().autocorr.integrated_time
    return np.asarray(np.mean([estimate(chain, tol=0, quiet=True) for chain in chains], axis=0))


def _split_r_hat(chains: FloatArray) -> FloatArray:
    """Return R-hat of (ensembles, steps, walkers, n) from the first and second halves of every ensemble."""
    half = chains.shape[1] // 2
    parts = np.concatenate([chains[:, :half], chains[:, half:2 * half]])
    flat = parts.reshape(len(parts), -1, parts.shape[-1])
    within = flat.var(axis=1, ddof=1).mean(axis=0)
    between = flat.mean(axis=1).var(axis=0, ddof=1)
    return np.asarray(np.sqrt(1 + between / np.maximum(within, 1e-300)))


def _check(problem: Problem, columns: list[int], walkers: int, ensembles: int) -> None:
    """Refuse fits without free parameters, odd numbers of walkers, and posteriors that are improper."""
    if not columns:
        fail("start", "a fit without free parameters", "must have at least one")
    if walkers % 2:
        fail("walkers", str(walkers), "must be even")
    parameters = [problem.parameters[j] for j in columns]
    open_ones = [p.name for p in parameters if p.prior is None and not np.isfinite(p.bounds).all()]
    if open_ones:
        fail("parameters", f"neither prior nor two finite bounds for {', '.join(open_ones)}", "the posterior would be improper",
             remedy="give prior_sd, or low and high")


def require_emcee() -> None:
    """Raise a ToolpointError that names the remedy where emcee is not installed."""
    _emcee()


def _emcee() -> Any:
    """Return the package emcee; raises with the remedy where it is not installed."""
    try:
        import emcee
        import emcee.autocorr
    except ImportError:
        raise ToolpointError("sampler: the package emcee is not installed; sampling a posterior needs it "
                             "(pip install 'toolpoint[bayes]'); the Bayesian fit without samples needs nothing more") from None
    return emcee
