"""Five free numbers are always a body's inertia ratios, and what is no body's is refused."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jffsr.errors import InputError
from jffsr.target.inertia_parameters import inertia_from_parameters, inertia_ratios, parameters_from_inertia
from jffsr.target.prior import TargetPrior


def test_any_numbers_are_a_bodys():
    rng = np.random.default_rng(1)
    numbers = 1.5 * rng.standard_normal((500, 5))
    moments = np.linalg.eigvalsh(np.asarray(inertia_from_parameters(numbers)))
    assert np.all(moments[:, 0] > 0)
    assert np.all(moments[:, 0] + moments[:, 1] > moments[:, 2])


def test_an_inertia_is_found_again_up_to_its_unit():
    turn = Rotation.from_euler("ZYX", [0.4, -0.7, 1.1]).as_matrix()
    inertia = turn @ np.diag([0.654, 0.95, 1.0]) @ turn.T
    numbers = parameters_from_inertia(250.0 * inertia)
    found = np.asarray(inertia_from_parameters(numbers))
    np.testing.assert_allclose(found / np.trace(found), inertia / np.trace(inertia), atol=1e-14)
    np.testing.assert_allclose(np.linalg.det(np.trace(found) / 2 * np.eye(3) - found), 1.0, rtol=1e-12)
    np.testing.assert_allclose(inertia_ratios(numbers), [0.654, 0.95, 1.0], atol=1e-14)
    np.testing.assert_allclose(parameters_from_inertia(np.eye(3)), 0.0, atol=1e-15)


def test_inconsistent_ratios_are_refused_before_any_estimate():
    with pytest.raises(InputError, match=r"target prior: .*\(0.2, 0.3, 1\).*0.2 \+ 0.3 is less than 1"):
        TargetPrior.create(inertia=(0.2, 0.3, 1.0))
    with pytest.raises(InputError, match=r"flat body, 0.4 \+ 0.6 = 1; an estimate must start inside"):
        TargetPrior.create(inertia=(0.4, 0.6, 1.0))
    with pytest.raises(InputError, match=r"inertia has shape \(2,\)"):
        TargetPrior.create(inertia=(0.4, 0.6))
    with pytest.raises(InputError, match="offset_deviation is 0; a positive number"):
        TargetPrior.create(offset_deviation=0.0)
    with pytest.raises(InputError, match=r"velocity is .*three finite numbers"):
        TargetPrior.create(velocity=(0.0, np.nan, 0.0))
