"""Studies of robots that are composed in their files, and 300 damaged copies of such files."""

from __future__ import annotations

import random

import numpy as np
import pytest
from composed_files import RIGHT, STUDY, TWINS
from mutations import mutate

from jffsr.errors import InputError
from jffsr.robots.loading import load_robot
from jffsr.study.building import build_problem, build_robot
from jffsr.study.config import load_config


@pytest.fixture
def folder(tmp_path):
    for name, text in (
        ("robots/twins.yaml", TWINS), ("arms/right.yaml", RIGHT), ("studies/study.yaml", STUDY)
    ):  # fmt: skip
        path = tmp_path / name
        path.parent.mkdir()
        path.write_text(text)
    return tmp_path


def test_a_study_names_a_composed_robot(folder):
    """Paths are relative to the file that they stand in, wherever the study is run from."""
    config = load_config(folder / "studies" / "study.yaml")
    robot = build_robot(config)
    assert robot.joint_names == ("left_joint1", "left_joint2", "right_joint1", "right_joint2", "right_joint3")
    np.testing.assert_array_equal(robot.limits.velocity, 0.3)
    np.testing.assert_allclose(robot.mass[0], 805)
    problem = build_problem(config)
    lower, upper = problem.bounds()
    assert lower.shape == upper.shape == (10,)


def test_a_study_tells_what_is_wrong_with_an_arm(folder):
    path = folder / "arms" / "right.yaml"
    path.write_text(RIGHT.replace("ye_planar3", "ye_planar4"))
    with pytest.raises(InputError) as told:
        build_robot(load_config(folder / "studies" / "study.yaml"))
    sentence = str(told.value)
    for part in (
        "study.yaml:2: robot: ", "twins.yaml:5: arms.1.robot: ", "right.yaml:3: arms.0.robot: ",
        "'ye_planar4' is not in the catalogue; did you mean 'ye_planar3'?",
    ):  # fmt: skip
        assert part in sentence
    assert "\n" not in sentence


def test_damaged_files_end_well(folder):
    """Each damaged copy builds a sound robot or is refused in one sentence."""
    path = folder / "robots" / "twins.yaml"
    built, told = 0, []
    for number in range(300):
        path.write_bytes(mutate(TWINS, random.Random(number)).encode("utf-8", "replace"))
        try:
            robot = load_robot(path)
        except InputError as error:
            told.append(str(error))
            continue
        built += 1
        assert np.all(np.isfinite(robot.mass)), f"mutation {number}"
        assert np.all(np.linalg.eigvalsh(robot.inertia) > 0), f"mutation {number}"
        assert np.all(np.isfinite(robot.joint_position)), f"mutation {number}"
    assert not [sentence for sentence in told if "\n" in sentence]
    assert min(built, len(told)) > 20
