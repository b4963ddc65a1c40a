"""Chains in run folders: what every stage leaves, where a chain ends and why, refusals in one sentence."""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import jffsr
from jffsr import cli
from jffsr.capture.mujoco_approach import Approach
from jffsr.crosscheck.beside_target import Contact
from jffsr.study.chain.carried_out import Chain, grasp_refused
from jffsr.study.chain.grasping import missed_by
from jffsr.study.chain.outcome import ChainCode, ChainResult
from jffsr.study.config import dump_config, load_config
from jffsr.study.dataset import open_dataset
from jffsr.viz.replay.reading import replays_of

CONFIG = """\
kind: chain
robot: ye_2019_planar3
limits: {rate: 1.0, acceleration: 1.0}
task: {start_deg: [60, -120, 60]}
target:
  mass: 8
  inertia: [1, 1, 1.5]
  position: [3.3, 0.1, 0]
  angular_velocity_deg: [0, 0, 1]
  grasps: {handle: {position: [-0.3, 0, 0]}}
  marker: {position: [0.02, -0.01, 0], rotation_vector_deg: [0, 0, 70]}
  shapes: [{type: box, size: [0.15, 0.15, 0.15]}]
observation: {duration: 4, acquisition: 30, camera: {noise: 0.02}}
grasp_time: {window: [10, 30]}
planner:
  {margin: null, times: 2, starts: 2, postures: 1, lanes: 2, num_steps: 20, improve: 0, tolerance: 0.02}
hold: {duration: 10, settled: 2, gains: {rate: 60, position: 8}}
output: {figures: false, progress: false}
"""


@pytest.fixture(scope="module")
def config(tmp_path_factory):
    """A planar arm, and a box that turns before it and a camera."""
    file = tmp_path_factory.mktemp("chain") / "planar.yaml"
    file.write_text(CONFIG)
    return file


def test_the_tools_errors_are_those_of_plane_geometry(robots):
    robot = robots["ye_2019_planar3"]
    target = jffsr.Target.create([1.0, 1.0, 1.5], grasps={"handle": ([-0.3, 0, 0], [1, 0, 0, 0])})
    q, rates = np.array([0.3, -0.5, 0.4]), np.array([0.1, 0.2, -0.1])
    state = jffsr.State(
        np.array([0.1, 0.2, 0.0]), np.array([1.0, 0, 0, 0]), q, np.array([0.01, 0.02, 0, 0, 0, 0.03]), rates
    )
    angles = np.cumsum(q)
    links = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    tool = np.array([0.6, 0.2]) + links.sum(axis=0)
    spins = 0.03 + np.cumsum(rates)
    speed = np.array([0.01, 0.02 + 0.03 * 0.5]) + np.sum(spins[:, None] * links[:, ::-1] * [-1, 1], axis=0)
    turn = 0.25
    grasp = np.array([3.3, 0.1]) - 0.3 * np.array([np.cos(turn), np.sin(turn)])
    moving = np.array([0.02, 0.0]) - 0.3 * 0.4 * np.array([-np.sin(turn), np.cos(turn)])
    quaternion = np.array([np.cos(turn / 2), 0, 0, np.sin(turn / 2)])
    target_state = jffsr.TargetState.create([3.3, 0.1, 0], [0.02, 0, 0], quaternion, [0, 0, 0.4])
    found = missed_by(robot, state, target, target_state, "handle", robot.end_effector_names[0])
    expected = [*(tool - grasp), 0, 0, 0, angles[-1] - turn, *(speed - moving), 0, 0, 0, spins[-1] - 0.4]
    np.testing.assert_allclose(found, expected, atol=1e-12)


def chain(missed, contacts=()):
    approach = Approach(np.zeros(1), None, None, np.zeros((0, 3)), 0.0, contacts)
    return Chain(ChainResult(ChainCode.GRASP_MISSED, ""), None, approach, np.asarray(missed, float))


def test_a_grasp_counts_only_within_its_tolerances(config):
    config = load_config(config)
    good = 0.99 * np.array([0.01, 0, 0, np.deg2rad(2), 0, 0, 0, 0.01, 0, 0, 0, 0.01])
    assert grasp_refused(config, chain(good)) is None
    for part, name in enumerate(("position", "attitude", "velocity", "angular velocity")):
        bad = good.copy()
        bad[3 * part : 3 * part + 3] *= 1.02
        told = grasp_refused(config, chain(bad))
        assert told.code is ChainCode.GRASP_MISSED
        assert f"its {name} by" in told.sentence
        assert told.sentence.count(" by ") == 1
    assert grasp_refused(config, chain(np.full(12, np.nan))).sentence.count(" by ") == 4
    touched = grasp_refused(config, chain(good, (Contact(("base", "target"), 3.0, 1e-3),)))
    assert touched.code is ChainCode.TOUCHED
    assert "base and target touch at 3 s" in touched.sentence


@pytest.mark.parametrize(
    ("override", "sentence"),
    [
        ("observation=null", "observation: is missing, a chain begins with a camera"),
        ("front={levels: 3}", "front: a chain carries out one plan"),
        ("task.base_mode=attitude_held", "task.base_mode: found 'attitude_held', a chain's base floats"),
        ("target.shapes=[]", "target.shapes: found no shape that can be touched"),
        ("grasp_tolerance.position=0", "grasp_tolerance.position: found 0"),
        ("grasp_tolerance.attitud=1", "grasp_tolerance.attitud:.*attitude"),
        ("approach.step=1", "approach.step: found 1"),
        ("hold.estimator=rls", "hold.estimator: found 'rls'"),
        ("hold.ranges.begin=1", "hold.ranges.begin: found 1, a number in \\[0, 1\\) is expected"),
        ("hold.ranges.gian=1", "hold.ranges.gian: unknown key; did you mean 'gain'"),
    ],
)
def test_bad_input_is_told_in_one_sentence(config, override, sentence, tmp_path, capsys):
    status = cli.main(["run", str(config), override, "--out", str(tmp_path / "run")])
    said = capsys.readouterr().err
    assert status == cli.BAD_INPUT
    assert said.count("\n") == 1
    with pytest.raises(jffsr.InputError, match=sentence):
        raise jffsr.InputError(said)


def test_shipped_configuration_reads_back_as_it_is(tmp_path):
    config = load_config("tumbling_capture")
    assert config.kind == "chain"
    copy = tmp_path / "copy.yaml"
    copy.write_text(dump_config(config))
    assert load_config(copy) == config


@pytest.mark.slow
def test_every_stage_leaves_its_file_and_the_momentum_goes_through(config, tmp_path):
    folder = tmp_path / "run"
    assert cli.main(["run", str(config), "--out", str(folder)]) == cli.MET
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["result"]["name"] == "held"
    assert summary["hold"]["base_rate"] < 1e-3
    files = {
        "observation.nc",
        "plan.nc",
        "approach.nc",
        "contact.json",
        "hold.nc",
        "result.nc",
        "config.yaml",
    }
    assert files <= {file.name for file in folder.iterdir()}
    observation, result = open_dataset(folder / "observation.nc"), open_dataset(folder / "result.nc")
    assert observation["time"].values[-1] == pytest.approx(-0.2)
    stage, time = result["stage"].values, result["time"].values
    assert time[stage == 0][-1] == time[stage == 1][0] == pytest.approx(summary["duration"])
    # Before the grasp the robot has no momentum, after it the target's about the common centre of mass.
    assert summary["contact"]["momentum"][5] == pytest.approx(1.5 * np.deg2rad(1.0), rel=1e-6)
    momentum = open_dataset(folder / "hold.nc")["momentum"].values
    np.testing.assert_allclose(
        momentum, np.broadcast_to(summary["contact"]["momentum"], momentum.shape), atol=1e-6
    )
    assert cli.main(["show", str(folder), "--html", "--report"]) == cli.MET
    (replay,) = replays_of(folder)
    # From the grasp on the tool carries the target, as it was when they met.
    (tool,) = [axes for axes in replay.axes if axes.name.startswith("axes of")]
    (box,) = [solid for solid in replay.solids if solid.name == "target"]
    turn = Rotation.from_quat(tool.quaternion, scalar_first=True)
    held = replay.time >= replay.marks[0][1] - 1e-9
    inside = turn.inv().apply(box.position - tool.position)[held]
    np.testing.assert_allclose(inside, np.broadcast_to(inside[0], inside.shape), atol=1e-9)
    assert np.linalg.norm(np.diff(box.position, axis=0), axis=1).max() < 0.1
    assert {"chain.png", "observation.png", "capture.png"} <= {f.name for f in (folder / "figures").iterdir()}
    assert cli.main(["run", str(config), "--out", str(folder)]) == cli.MET


@pytest.mark.slow
def test_a_grasp_that_is_missed_ends_the_chain(config, tmp_path):
    folder = tmp_path / "run"
    assert (
        cli.main(["run", str(config), "grasp_tolerance.position=1e-9", "--out", str(folder)]) == cli.NOT_MET
    )
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["result"]["name"] == "grasp_missed"
    assert summary["hold"] is None
    assert not (folder / "hold.nc").exists()
    assert np.all(open_dataset(folder / "result.nc")["stage"].values == 0)
