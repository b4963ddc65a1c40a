"""A sweep says which of its constraints a point misses, by how much, and in what unit."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import xarray

from jffsr.objectives.clearance import Clearance
from jffsr.objectives.constraints import FinalAttitude, JointLimits
from jffsr.study.sweep.merging import merged, save_sweep
from jffsr.study.sweep.misses import merged_misses, missed_in_words, misses_of
from jffsr.study.sweep.parts import Part

LEVEL = np.array([1.0, 0.0, 0.0, 0.0])


def problem(*constraints):
    return SimpleNamespace(constraints=constraints)


def kept_apart(margin_missed):
    """Results of two points, which are to keep bodies apart and their limits; the first misses only the clearance."""
    problems = [
        problem(Clearance(None, tolerance=1e-3), JointLimits(tolerance=1e-3)),
        problem(Clearance(None, tolerance=2e-3), JointLimits(tolerance=1e-3)),
    ]
    violations = {"clearance": np.array([margin_missed, 0.0]), "joint_limits": np.array([0.0, 0.02])}
    return misses_of(problems, violations)


def test_a_miss_is_in_the_constraint_s_own_unit():
    found = kept_apart(0.25)
    assert found["constraints"].tolist() == ["clearance", "joint_limits"]
    assert found["constraint_units"].tolist() == ["m", ""]
    # A clearance counts per 0.1 m.
    np.testing.assert_allclose(found["constraint_missed"], [[0.025, 0.0], [0.0, 0.02]])
    np.testing.assert_allclose(found["constraint_allowed"], [[1e-4, 1e-3], [2e-4, 1e-3]])
    none = misses_of([problem()], {})
    assert none["constraint_missed"].shape == (1, 0)


def test_points_with_other_constraints_are_told_apart(tmp_path):
    points = [SimpleNamespace(values={"task.duration": duration}) for duration in (20, 30, 40, 50)]
    turned = misses_of([problem(FinalAttitude(LEVEL, tolerance=1e-5))], {"final_attitude": np.array([0.5])})
    history = ("best_value", "evaluations", "gradient_evaluations")

    def part(numbers, results):
        count = len(numbers)
        rest = {
            "code": np.ones(count),
            "free_numbers": np.ones((count, 3)),
            "terms": np.array(["joint_rate"]),
            "term_value": np.ones((count, 1)),
            "term_weighted": np.ones((count, 1)),
            **{f"history_{name}": np.ones((count, 1)) for name in history},
        }
        return Part(numbers, {**rest, **results})

    # The last is of a version that did not keep what was missed.
    parts = [part((2, 0), kept_apart(0.25)), part((1,), turned), part((3,), {})]
    dataset = merged(points, parts, "s", 1.0)
    save_sweep(dataset, tmp_path / "sweep.nc")
    np.testing.assert_allclose(dataset["missed_clearance"].values, [0.0, np.nan, 0.025, np.nan])
    assert dataset["missed_clearance"].attrs["units"] == "m"
    assert dataset["allowed_joint_limits"].attrs["units"] == "1"
    assert missed_in_words(dataset, 2) == ["clearance missed by 0.025 m (allowed 0.0001 m)"]
    assert missed_in_words(dataset, 0) == ["joint limits missed by 0.02 (allowed 0.001)"]
    assert missed_in_words(dataset, 1) == ["final attitude missed by 0.5 rad (allowed 1e-05 rad)"]
    assert missed_in_words(dataset, 3) == []


def test_the_constraint_missed_most_comes_first():
    results = misses_of(
        [problem(JointLimits(tolerance=1e-3), FinalAttitude(LEVEL, tolerance=1e-5))],
        {"joint_limits": np.array([0.5]), "final_attitude": np.array([0.1])},
    )
    dataset = xarray.Dataset(merged_misses(1, [((0,), results)]))
    assert [words.split(" missed")[0] for words in missed_in_words(dataset, 0)] == [
        "final attitude",
        "joint limits",
    ]
