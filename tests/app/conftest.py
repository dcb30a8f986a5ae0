"""What all tests of commands share."""

import pytest


@pytest.fixture(autouse=True)
def _without_other_cuts(without_other_cuts):
    """A page of lobes without limits at other immersions and numbers of teeth, unless they are asked for."""
