"""Clearance has the same values and gradients on several devices as on one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from virtual_devices import output_of


@pytest.mark.slow
def test_gradients_do_not_depend_on_the_devices():
    found = output_of(Path(__file__).parent / "two_devices.py", devices=2)
    for one, two in zip(found["1"], found["2"], strict=True):
        np.testing.assert_allclose(two, one, rtol=1e-12)
    assert np.abs(found["1"][1]).max() > 0.01
