"""Configurations: composition, overrides, round trip, and the line of every key."""

import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from config_files import GOOD, folder, load, write  # noqa: F401 (the fixture acts by being here)

from jffsr.errors import InputError
from jffsr.robots.loading import load_robot
from jffsr.study.building import build_robot
from jffsr.study.config import dump_config, load_config
from jffsr.study.schema import PlanningConfig

ROOT = Path(__file__).resolve().parents[2]
JOINTS, OWN = ("shoulder", "elbow"), (1.0, 1.0)
SHIPPED = sorted((ROOT / "configs" / "planning").glob("*.yaml"))


# --- what a good file gives ---


def test_defaults_are_those_of_the_schema():
    config = load(GOOD)
    assert (config.name, config.robot, config.seed, config.precision) == ("x", "wu_6dof", 0, "float64")
    assert config.optimizer.kind == "hybrid"
    assert config.optimizer.contraction == (1.0, 0.5)
    assert config.objective.attitude_change.scale_si == math.radians(0.1)
    assert config.trajectory.box == math.pi
    assert config.limits.rate_si is None
    assert config.limits.base_excursion_si is None
    # No limit to the excursion is given, so that its term does not count.
    assert config.enabled_terms == ("attitude_change", "joint_rate", "joint_acceleration")


def test_degrees_become_radians_and_radians_stay():
    config = load(GOOD + "limits: {position_deg: 180, rate: 0.25, acceleration_deg: [9, 18]}\n")
    assert config.task.start_si == (0.0, math.pi / 2)
    assert config.limits.position_si == (-math.pi, math.pi)
    assert config.per_joint("rate", JOINTS, OWN) == (0.25, 0.25)
    assert config.per_joint("acceleration", JOINTS, OWN) == (math.radians(9), math.radians(18))
    assert config.per_joint("position", JOINTS, OWN) == ((-math.pi, math.pi),) * 2
    pairs = load(GOOD + "limits: {position: [[-1, 2], [0, 1e-3]], base_excursion_deg: 10}\n")
    assert pairs.per_joint("position", JOINTS, OWN) == ((-1.0, 2.0), (0.0, 0.001))
    assert pairs.limits.base_excursion_si == (math.radians(10),) * 3
    assert pairs.per_joint("rate", JOINTS, OWN) is None


def test_a_limit_for_another_number_of_joints_is_refused_with_its_line():
    config = load(GOOD + "limits:\n  rate_deg: [1, 2]\n")
    with pytest.raises(InputError) as caught:
        config.per_joint("rate", ["j1", "j2", "j3"], [1.0] * 3)
    assert str(caught.value) == "x.yaml:8: limits.rate_deg: found a list of 2, the robot has 3 joints"


def test_limits_of_some_joints_are_given_by_name():
    """The others keep the robot's; what is read back from the folder is the same."""
    text = (
        GOOD
        + "limits:\n  position_deg: {elbow: [-90, 180]}\n  rate_deg:\n    elbow: 9\n  torque: {shoulder: 3}\n"
    )
    config = load(text)
    own = [(-1.0, 1.0), (-np.inf, np.inf)]
    assert config.per_joint("position", JOINTS, own) == ((-1.0, 1.0), (-math.pi / 2, math.pi))
    assert config.per_joint("rate", JOINTS, [0.3, np.inf]) == (0.3, math.radians(9))
    assert config.per_joint("torque", JOINTS, [1.0, 2.0]) == (3.0, 2.0)
    assert load(dump_config(config)) == config
    robot = build_robot(load(GOOD + "limits: {rate: {joint2: 0.1}}\n", "robot=hu_planar2"))
    assert robot.limits.velocity[1] == 0.1
    assert robot.limits.velocity[0] == load_robot("hu_planar2").limits.velocity[0]


@pytest.mark.parametrize(
    ("limits", "told"),
    [
        ("{rate: {elbo: 1}}", "limits.rate.elbo: the robot has no such joint; did you mean 'elbow'?"),
        (
            "{rate: {wheel: 1}}",
            "limits.rate.wheel: the robot has no such joint; the joints are shoulder, elbow",
        ),
    ],
)
def test_a_limit_of_a_joint_that_is_none_is_refused_with_its_line(limits, told):
    config = load(GOOD + f"limits: {limits}\n")
    with pytest.raises(InputError) as caught:
        config.per_joint("rate", JOINTS, OWN)
    assert str(caught.value) == f"x.yaml:7: {told}"


@pytest.mark.parametrize(
    ("limits", "told"),
    [
        ("{rate: {elbow: -1}}", "limits.rate.elbow: found -1, a number > 0 is expected"),
        (
            "{position_deg: {elbow: 90}}",
            "limits.position_deg.elbow: found 90, a pair [low, high] for each joint is expected",
        ),
    ],
)
def test_a_limit_by_name_is_checked_like_any(limits, told):
    with pytest.raises(InputError) as caught:
        load(GOOD + f"limits: {limits}\n")
    assert str(caught.value) == f"x.yaml:7: {told}"


def test_duration_is_given_or_free():
    assert load(GOOD).task.duration_range == (30.0, 30.0)
    assert not load(GOOD).task.duration_is_free
    free = load(GOOD.replace("30", "{min: 10, max: 40}")).task
    assert free.duration_range == (10.0, 40.0)
    assert free.duration_is_free


def test_a_goal_attitude_turns_one_term_on_and_another_off():
    config = load(GOOD + "  goal_attitude: [1.0005, 0, 0, 0]\n")
    assert config.task.goal_attitude == (1.0, 0.0, 0.0, 0.0)
    assert config.enabled_terms == ("joint_rate", "joint_acceleration", "goal_attitude")
    own = load(GOOD + "objective: {terms: [{call: my_pkg.my_term}, {call: a.b, name: c}]}\n")
    assert own.enabled_terms[-2:] == ("my_term", "c")


@pytest.mark.parametrize(
    ("written", "read"),
    [("1e-3", 0.001), ("1E3", 1000.0), ("+.5", 0.5), ("5.", 5.0), ("1_000", 1000.0), ("7", 7.0)],
)
def test_numbers_as_people_write_them(written, read):
    assert load(GOOD + f"limits: {{rate: {written}}}\n").limits.rate == read


def test_whole_numbers_may_have_an_exponent_and_switches_may_say_no():
    config = load(GOOD + "optimizer: {evaluations: 2e4}\noutput: {figures: no}\n")
    assert config.optimizer.evaluations == 20000
    assert type(config.optimizer.evaluations) is int
    assert config.output.figures is False


def test_null_takes_back_what_another_file_gave():
    write("base.yaml", GOOD)
    config = load("defaults: [base]\ntask: {start_deg: null, start: [0, 1]}\n")
    assert config.task.start_si == (0.0, 1.0)


# --- composition and overrides ---


def test_later_defaults_win_and_the_file_wins_over_all():
    write("parts/robot.yaml", GOOD + "seed: 1\nname: other\nrollout: {num_steps: 10}\n")
    write("parts/more.yml", "seed: 2\nrollout: {num_steps: 20}\noptimizer: {particles: 8}\n")
    config = load("defaults: [parts/robot, parts/more.yml]\nrollout: {num_steps: 30}\n")
    assert (config.seed, config.rollout.num_steps, config.optimizer.particles) == (2, 30, 8)
    assert config.name == "x", "a name belongs to the file that gives it"
    assert config.task.goal_si == (math.radians(45), math.radians(3))


def test_defaults_are_relative_to_their_own_file():
    write("a/b/deep.yaml", GOOD)
    write("a/mid.yaml", "defaults: [b/deep]\nseed: 4\n")
    assert load("defaults: [a/mid]\n").seed == 4


def test_overrides_win_in_order():
    config = load(
        GOOD,
        "seed=5",
        "seed=6",
        "optimizer.particles=64",
        "task.goal_deg=[1, 2]",
        "task.goal_deg.0=10",
        "task.duration={min: 1, max: 2}",
        "name='1e-3'",
        "objective.terms=[{call: a.b}]",
    )
    assert config.seed == 6
    assert config.optimizer.particles == 64
    assert config.task.goal_deg == (10.0, 2.0)
    assert config.task.duration_range == (1.0, 2.0)
    assert config.name == "1e-3"
    assert config.objective.terms[0].call == "a.b"


def test_a_robot_file_is_found_relative_to_the_file_that_names_it():
    write("sub/base.yaml", GOOD.replace("wu_6dof", "../robots/mine.yaml"))
    assert load("defaults: [sub/base]\n").robot == os.path.abspath("robots/mine.yaml")
    assert load(GOOD, "robot=./mine.yaml").robot == os.path.abspath("mine.yaml")


def test_where_gives_the_line_of_a_key_of_its_section_or_its_override():
    write("base.yaml", GOOD)
    config = load("# first\ndefaults: [base]\nlimits:\n  rate: 0.1\n", "seed=3", "task.goal_deg.1=7")
    assert config.where("task.start_deg") == "base.yaml:4: task.start_deg"
    assert config.where("task.goal_deg.0") == "base.yaml:5: task.goal_deg.0"
    assert config.where("task.goal_deg.1") == "override 'task.goal_deg.1=7': task.goal_deg.1"
    assert config.where("limits.rate") == "x.yaml:4: limits.rate"
    assert config.where("limits.acceleration") == "x.yaml:3: limits.acceleration"
    assert config.where("task.end_effector") == "base.yaml:3: task.end_effector"
    assert config.where("seed") == "override 'seed=3': seed"
    assert config.where("precision") == "x.yaml:2: precision"


# --- the shipped scenarios, and writing back ---


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_shipped_configurations_load_by_name_and_reload_as_equals(path):
    config = load_config(path.stem)
    assert config == load_config(path)
    assert config.name == path.stem
    again = load_config(write("run/config.yaml", dump_config(config)))
    assert again == config
    assert dump_config(again) == dump_config(config)


def test_the_five_scenarios_are_shipped():
    names = ["composite_7dof", "composite_wu6", "composite_wu6_impossible"]
    assert [path.stem for path in SHIPPED] == [*names, "composite_wu6_momentum", "composite_wu6_tight"]


def test_names_under_configs_are_found(folder):  # noqa: F811
    write("configs/planning/mine.yaml", GOOD)
    write("configs/other/twice.yaml", GOOD)
    write("configs/planning/twice.yaml", GOOD)
    assert load_config("mine").name == "mine"
    assert (
        load_config("planning/mine")
        == load_config("planning/mine.yaml")
        == load_config("configs/planning/mine")
    )
    with pytest.raises(InputError) as caught:
        load_config("twice")
    paths = "configs/other/twice.yaml or configs/planning/twice.yaml"
    assert str(caught.value) == f"'twice' is the name of several configurations, give one of {paths}"


def test_an_unusual_configuration_round_trips():
    extra = """\
  base_quaternion: [0.7072, 0.7072, 0.0, 1e-5]
  end_effector: "no"
limits: {position: [[-1, 2], [0.1, 0.3]], rate_deg: [1, 2], base_excursion: [0.1, 0.2, 0.30000000000000004]}
objective: {attitude_change: {scale: 0.002}, terms: [{call: a.b, weight: 0.1}, {call: a.c}]}
optimizer: {kind: qpso, target: 0}
name: "12"
"""
    config = load(GOOD.replace("30", "{min: 10, max: 40}") + extra)
    again = load_config(write("config.yaml", dump_config(config)))
    assert again == config
    assert isinstance(again, PlanningConfig)
    assert again != load(GOOD)


def test_the_written_form_is_readable_and_complete():
    text = dump_config(load(GOOD))
    assert "  start_deg: [0.0, 90.0]\n" in text
    assert "start:" not in text
    assert "  scale_deg: 0.1\n" in text.replace("    ", "  ")
    assert "seed: 0\n" in text
    assert "learning_rate: 0.05\n" in text


def test_importing_the_configuration_imports_no_heavy_package():
    code = (
        "import sys, jffsr.study.config\n"
        "sys.exit(sum(m in sys.modules for m in 'jax numpy matplotlib xarray mujoco omegaconf'.split()))"
    )
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_options_of_the_optimizer_come_back_as_they_were():
    given = "optimizer:\n  kind: hybrid\n  options: {swarm: pso, rule: success, inertia_end: 0.3}\n"
    config = load(GOOD + given)
    assert config.optimizer.options == {"swarm": "pso", "rule": "success", "inertia_end": 0.3}
    assert load(dump_config(config)) == config
    assert load(GOOD, "optimizer.kind=de", "optimizer.options.strategy=pbest").optimizer.options == {
        "strategy": "pbest"
    }
