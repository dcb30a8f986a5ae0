"""The page of a machine, of measured responses, or of both."""

from __future__ import annotations

from collections.abc import Sequence

from toolpoint.pages.machines.machine import machine_page
from toolpoint.pages.measured.responses import with_measured
from toolpoint.plot import Report
from toolpoint.studies.first_look import FirstLook


def first_look_page(result: FirstLook, *, source: str = "", file_name: str = "", names: Sequence[str] = (),
                    warnings: Sequence[str] = ()) -> Report:
    """Return the page; `source` is the text of the machine's file, `names` those of the files of responses.

    Examples
    --------
    Runs in ``examples/report_measured_responses.py``.
    """
    report = (Report("Measured frequency responses", subtitle=", ".join(names)) if result.machine is None else
              machine_page(result.machine, source, file_name))
    report = report if result.measured is None else with_measured(report, result.measured)
    return report.with_doubts(*warnings)
