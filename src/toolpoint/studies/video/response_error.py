r"""Measured responses beside a machine's before and after an update, and their error over each joint parameter, one at a time.

The error is :math:`\sqrt{\sum |H - H_t|^2 / \sum |H_t|^2}` over the lines and the measured pairs of degrees of freedom, with
:math:`H_t` measured. Where a parameter changes it by little over two decades, responses cannot tell that parameter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, IndexArray
from toolpoint._notebook import NotebookText
from toolpoint._rounding import number_text
from toolpoint.machine import Machine, assemble
from toolpoint.studies.text_table import text_table
from toolpoint.vibration import Dof, Frf, correlation, frequency_response

SWEPT_FACTORS = np.geomspace(0.1, 10.0, 11)  # of each parameter, its own value in the middle
MAX_SWEPT_LINES = 100  # of the measured ones, evenly chosen
FRAC_HEADER = ("response", "FRAC before", "FRAC after")
SWEEP_HEADER = ("parameter", "error, least", "at times", "error, most", "at times")


@dataclass(frozen=True, eq=False)
class ResponseError(NotebookText):
    """Relative error of a machine's responses over each joint parameter, the others as they are.

    paths : (n,) of the parameters; factors : (m,) of each; error : (n, m); unchanged : the error of the machine as it is.
    """

    paths: tuple[str, ...]
    factors: FloatArray
    error: FloatArray
    unchanged: float

    @property
    def ranking(self) -> IndexArray:
        """Parameters in the order of how far they move the error."""
        return np.argsort(-np.ptp(self.error, axis=1), kind="stable")

    def rows(self) -> list[list[str]]:
        """Return path, least error and its factor, greatest error and its factor; what moves the error most first."""
        result = []
        for i in self.ranking.tolist():
            ends = int(self.error[i].argmin()), int(self.error[i].argmax())
            result.append([self.paths[i], *(text for k in ends for text in (
                f"{100 * self.error[i, k]:.3g} %", number_text(float(self.factors[k]), digits=3)))])
        return result

    def table(self) -> str:
        """Return the error over each parameter as text."""
        title = f"Error of the responses over each joint parameter ({100 * self.unchanged:.3g} % as it is)"
        return text_table(title, SWEEP_HEADER, self.rows())

    def to_dict(self) -> dict[str, Any]:
        """Return paths, factors and errors as plain data."""
        return {"paths": list(self.paths), "factors": self.factors.tolist(), "error": self.error.tolist(),
                "unchanged": self.unchanged}


@dataclass(frozen=True, eq=False)
class UpdatedResponses(NotebookText):
    """Measured responses at a machine's points beside those before and after its update, and the error over each parameter."""

    measured: Frf
    before_update: Frf
    after_update: Frf
    error: ResponseError

    def rows(self) -> list[list[str]]:
        """Return every response with its FRAC before and after."""
        old_frac, new_frac = (correlation.frac(self.measured, each) for each in (self.before_update, self.after_update))
        return [[f"{output} / {source}", f"{old_frac[i, k]:.4f}", f"{new_frac[i, k]:.4f}"]
                for i, output in enumerate(self.measured.outputs) for k, source in enumerate(self.measured.inputs)]

    def table(self) -> str:
        """Return FRAC and the error over each parameter as text."""
        return "\n".join([text_table("Measured responses and the machine's", FRAC_HEADER, self.rows()), "", self.error.table()])

    def to_dict(self) -> dict[str, Any]:
        """Return FRAC and errors as plain data."""
        return {"frac": self.rows(), "error": self.error.to_dict()}


def compare_updated(original: Machine, updated: Machine, measured: Frf, *, band: tuple[float, float] | None = None
                    ) -> UpdatedResponses:
    """Return measured responses beside those of a machine before and after its update; all at points of the machine.

    band : (low, high), Hz; all lines above 0 Hz where left out.
    """
    ends = (0.0, np.inf) if band is None else band
    test = measured.between(max(ends[0], float(measured.frequency[measured.frequency > 0].min())), ends[1])
    return UpdatedResponses(test, _response(original, test), _response(updated, test), sweep_response_error(updated, [test]))


def sweep_response_error(machine: Machine, tests: Sequence[Frf], paths: Sequence[str] = ()) -> ResponseError:
    """Return the error of a machine's responses beside measured ones over each joint parameter.

    tests : at points of the machine, on the same lines; paths : stiffness and damping of all joints where left out.
    """
    names = tuple(paths) or tuple(
        f"joints.{name}.{kind}.{way}" for name, joint in machine.description.joints.items() for kind in ("stiffness", "damping")
        for way, value in getattr(joint, kind).items() if value)
    chosen = np.unique(np.linspace(0, tests[0].frequency.size - 1, MAX_SWEPT_LINES).round().astype(int))
    lines = tests[0].frequency[chosen]
    quantity = tests[0].quantity  # as measured: integrating accelerances would weigh the noise of the lowest lines
    values = [test.converted_to(quantity).values[chosen] for test in tests]

    def error_of(model: Machine) -> float:
        # One solution for all tests: their outputs and inputs together.
        outputs, inputs = (tuple(dict.fromkeys(dof for test in tests for dof in labels(test)))
                           for labels in (lambda test: test.outputs, lambda test: test.inputs))
        response = frequency_response.direct(assemble(model, None, outputs, inputs=inputs), lines, quantity)
        misfit = sum(float((np.abs(response.selected(test.outputs, test.inputs).values - value) ** 2).sum())
                    for test, value in zip(tests, values, strict=True))
        return float(np.sqrt(misfit / sum(float((np.abs(value) ** 2).sum()) for value in values)))

    error = np.array([[error_of(machine.with_values({name: factor * machine.value(name)})) for factor in SWEPT_FACTORS]
                      for name in names]).reshape(len(names), SWEPT_FACTORS.size)
    return ResponseError(names, SWEPT_FACTORS, error, error_of(machine))


def points_missing(machine: Machine, measured: Frf) -> list[str]:
    """Return the points of measured responses that the machine does not have."""
    labels: list[Dof] = [*measured.outputs, *measured.inputs]
    return [name for name in dict.fromkeys(str(dof.point) for dof in labels) if name not in machine.description.points]


def _response(machine: Machine, test: Frf) -> Frf:
    """Return the machine's responses on the lines and in the quantity of a test."""
    return frequency_response.direct(assemble(machine, None, test.outputs, inputs=test.inputs), test.frequency, test.quantity)
