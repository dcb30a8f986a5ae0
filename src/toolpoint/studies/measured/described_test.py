"""Records of a test as its file describes them: struck by a hammer, or shaken."""

from __future__ import annotations

from toolpoint.signals.record_set import RecordSet
from toolpoint.signals.test_description import HammerTestDescription
from toolpoint.studies.measured.hammer_study import HammerStudy, study_hammer_records
from toolpoint.studies.measured.shaker_study import ShakerStudy, study_shaker_records


def study_described_records(records: RecordSet, description: HammerTestDescription) -> HammerStudy | ShakerStudy:
    """Return the responses of a test by hammer or shaker, with the settings and sensor masses of its description.

    Examples
    --------
    >>> import numpy as np
    >>> from toolpoint.signals.record_set import RecordSet
    >>> from toolpoint.signals.test_description import HammerTestDescription, RecordsDescription
    >>> from toolpoint.studies import study_described_records
    >>> from toolpoint.vibration import Record
    >>> force = np.random.default_rng(1).standard_normal(16384)
    >>> record = Record(np.column_stack([force, 0.5 * force]), 1024.0, ["1:+z", "1:+z"], ["force", "acceleration"])
    >>> shaken = HammerTestDescription("bed", (RecordsDescription(("a.h5",)),), excitation="random", resolution=4.0)
    >>> study_described_records(RecordSet((record,), ("a.h5",)), shaken).settings.excitation
    'random'
    """
    if (settings := description.shaker) is not None:
        return study_shaker_records(records, settings, masses=description.sensor_masses)
    return study_hammer_records(records, duration=description.block, final=description.window_end,
                                estimator=description.estimator, masses=description.sensor_masses)
