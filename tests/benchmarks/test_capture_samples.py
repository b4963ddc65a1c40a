"""Random captures: the same from the same seed, of bodies that can be, seen from outside."""

from __future__ import annotations

import numpy as np
import pytest

from experiments.captures import sampling
from experiments.captures.page import CaptureSet, tables
from experiments.captures.work import feasible, read_lines, write_line

SAMPLES = [sampling.draw(7, number) for number in range(200)]


def test_a_sample_is_fixed_by_its_seed_and_number():
    again = sampling.draw(7, 150)
    for name in vars(again):
        np.testing.assert_array_equal(getattr(again, name), getattr(SAMPLES[150], name))
    assert not np.allclose(sampling.draw(8, 150).position, again.position)


def test_samples_stay_within_their_ranges():
    inertia = np.array([s.inertia for s in SAMPLES])
    assert np.all(2 * inertia.max(axis=1) < inertia.sum(axis=1))
    assert np.all(inertia.min(axis=1) >= sampling.LEAST_RATIO * inertia.max(axis=1) * (1 - 1e-12))
    rates = np.linalg.norm([s.rate for s in SAMPLES], axis=1)
    assert np.all(rates <= np.deg2rad(5.0))
    assert rates.max() > np.deg2rad(4.5)
    positions = np.array([s.position for s in SAMPLES])
    assert np.all((positions >= sampling.CENTRE_LOW) & (positions <= sampling.CENTRE_HIGH))
    for sample in SAMPLES:
        np.testing.assert_allclose(np.linalg.norm(sample.quaternion), 1.0, rtol=1e-12)
        # The handle stands out of the face that the approach axis +x looks at.
        assert sample.grasp_position[0] == pytest.approx(-sample.half[0] - sampling.STANDS_OUT)
        shape = sampling.geometry(sample.half).shapes[0]
        assert not shape.contains(sample.grasp_position[None])[0]


def test_attitudes_prefer_no_direction():
    """The mean of the handles' axes over many samples is zero to its standard error."""
    w, x, y, z = np.array([sampling.draw(9, n).quaternion for n in range(1000)]).T
    axis = np.array([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)])
    assert np.all(np.abs(axis.mean(axis=1)) < 4 * np.sqrt(1 / 3 / 1000))


def test_two_seeds_stand_in_the_seed_file():
    assert sampling.read_seed("first") != sampling.read_seed("second")


def test_lines_are_kept_and_a_torn_one_is_left_out(tmp_path):
    path = tmp_path / "kept" / "lines.jsonl"
    for number, reason in enumerate((0, 2, 0, 0)):
        write_line(path, {"number": number, "reason": reason, "time": 20.0})
    with path.open("a") as file:
        file.write('{"number": 4, "rea')
    lines = read_lines(path)
    assert feasible(lines, 2) == [0, 2]
    assert len(lines) == 4


def test_the_page_counts_what_was_solved_first_or_second():
    line = {
        "errors": [1e-6] * 4,
        "violations": {"clearance": 0.5},
        "attempts": 1,
        "duration": 20.0,
        "jacobians": 9,
    }
    first = [{**line, "number": n, "code": code, "seconds": 0.5} for n, code in enumerate((0, 0, 5, 5))]
    again = [
        {**line, "number": 2, "code": 0, "seconds": 3.0},
        {**line, "number": 3, "code": 5, "seconds": 4.0},
    ]
    verdicts = [{"reason": r} for r in (0, 0, 2, 0, 3, 0)]
    text = tables([CaptureSet("first", "floating", verdicts, first, again)])
    assert "| first, base floating | 4 | 50.0 % | 75.0 % | 0.500 | 3.50 |" in text
    assert "| first | 6 | 66.7 % | 0 | 1 | 1 | 0 | 0 |" in text
    assert "| first, base floating: not found | clearance | 1 | 20.0, 20.0 | 3 |" in text
