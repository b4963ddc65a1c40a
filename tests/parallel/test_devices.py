"""Work spread over 1, 2 and 4 virtual devices gives the same numbers, uneven batches included."""

from __future__ import annotations

from pathlib import Path

import chex
import numpy as np
import pytest
from virtual_devices import output_of


@pytest.fixture(scope="module")
def found():
    """What four_devices.py prints."""
    return output_of(Path(__file__).parent / "four_devices.py", devices=4)


@pytest.mark.parametrize(
    ("devices", "what"),
    [("2", "values"), ("4", "values"), ("2", "gradients"), ("4", "gradients"), ("4", "search")],
)
def test_numbers_do_not_depend_on_the_devices(found, devices, what):
    one, other = (_arrays(found[key][what]) for key in ("1", devices))
    assert all(x.size for x in one)
    chex.assert_trees_all_close(other, one, rtol=1e-12, atol=1e-12)


def test_a_search_goes_on_from_the_host_to_the_same_bits(found):
    assert found["1"]["resumed"]
    assert found["4"]["resumed"]


def test_without_a_mesh_all_devices_are_used(found):
    assert found["devices"] == 4


def _arrays(value):
    """Lists of lists of numbers as a list of arrays."""
    return [np.array(item, dtype=float) for item in value]
