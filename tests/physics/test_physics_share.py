"""A small seeded share of `make check-physics`: two topologies, four robots each, every law."""

from __future__ import annotations

import numpy as np
import pytest
from laws import TOLERANCE, batch_of, check

LAWS = 31


@pytest.mark.parametrize("number", [2, pytest.param(6, marks=pytest.mark.slow)])
def test_every_law_holds(number):
    batch = batch_of(1, number, 4)
    assert batch.torques.shape == (4, number + 1)
    errors = check(batch, 2000)
    broken = {law: values for law, values in errors.items() if not np.all(values <= TOLERANCE)}
    assert not broken
    assert len(errors) == LAWS
    assert all(values.shape == (4,) for values in errors.values())
