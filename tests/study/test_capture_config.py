"""Capture studies read and refused: the one sentence for every kind of mistake, and what a file becomes."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from scipy.spatial.transform import Rotation

from jffsr.capture.front import CaptureFront
from jffsr.capture.manipulability import MEASURES
from jffsr.capture.problem import NUM_STEPS
from jffsr.errors import InputError
from jffsr.study.capture import schema_planner
from jffsr.study.capture.building import build_settings, build_study, build_terms
from jffsr.study.capture.dataset import front_variables
from jffsr.study.capture.summary import front_summary
from jffsr.study.config import dump_config, load_config
from jffsr.study.dataset import open_dataset, save_dataset
from jffsr.study.planning import plan
from jffsr.study.sweep.points import expand
from jffsr.study.sweep.specification import read_sweep
from jffsr.target.camera import Camera
from jffsr.target.grasp_frames import grasp_frame
from jffsr.target.prediction import ConvergenceTolerances
from jffsr.target.prior import TargetPrior

CONFIG = "tumbling_box"


def refused(*overrides: str) -> str:
    """What is said of the configuration, its robot and its target, before anything is planned or written."""
    with pytest.raises(InputError) as error:
        build_study(load_config(CONFIG, overrides))
    return str(error.value)


@pytest.mark.parametrize("name", ["wang_2021", "tumbling_box", "observed_box"])
def test_a_resolved_configuration_reads_as_an_equal_one(name, tmp_path):
    config = load_config(name)
    (tmp_path / "again.yaml").write_text(dump_config(config))
    assert load_config(tmp_path / "again.yaml") == config


def test_defaults_and_names_are_those_of_the_package():
    config = load_config("observed_box", ["planner.num_steps=50"])
    assert schema_planner.LostManipulability.model_fields["measure"].annotation.__args__ == MEASURES
    assert config.planner.num_steps == NUM_STEPS
    camera, prior, wanted = (
        config.observation.camera,
        config.observation.prior,
        config.observation.convergence,
    )
    for name in ("rate", "position_deviation", "delay", "dropouts", "outliers", "outlier_factor"):
        assert getattr(camera, name) == getattr(Camera(), name)
    assert camera.si("attitude_deviation") == Camera().attitude_deviation
    for name in ("inertia_deviation", "velocity_deviation", "offset_deviation"):
        assert getattr(prior, name) == getattr(TargetPrior.create(), name)
    assert prior.si("angular_velocity_deviation") == TargetPrior.create().angular_velocity_deviation
    sizes = [wanted.position, wanted.si("attitude"), wanted.linear_velocity, wanted.si("angular_velocity")]
    np.testing.assert_array_equal(sizes, ConvergenceTolerances().sizes)
    assert wanted.confidence == ConvergenceTolerances().confidence


def test_what_is_written_reaches_the_planner():
    asked = ["planner.margin=0.05", "planner.cone_half_angle_deg=20", "grasp_time.time=20", "seed=7"]
    config = load_config(
        CONFIG, [*asked, "objective.lost_manipulability={enabled: true, measure: published}"]
    )
    settings = build_settings(config, 20.0)
    assert (settings.margin, settings.half_angle) == (0.05, np.deg2rad(20.0))
    assert settings.candidates.window == (20.0, 20.0)
    assert (settings.candidates.times, settings.candidates.seed, settings.free_time) == (1, 7, False)
    assert build_settings(config, None).candidates.window == (15.0, 40.0)
    study = build_study(config)
    terms = build_terms(config, study, None)
    assert [term.name for term in terms] == ["base_disturbance", "lost_manipulability"]
    assert terms[1].measure == "published"
    without = load_config(CONFIG, ["planner.cone=false", "planner.margin=null", "target.shapes=[]"])
    assert build_settings(without, None).half_angle is None


def test_the_published_attitude_is_made_unit_and_noted():
    study = build_study(load_config("wang_2021"))
    (note,) = study.notes
    assert note.startswith("configs/capture/wang_2021.yaml:")
    assert note.endswith("target.quaternion: the quaternion of norm 1.014 was normalised")
    np.testing.assert_allclose(study.target_state.quaternion, [np.sqrt(0.5), np.sqrt(0.5), 0, 0], atol=1e-15)
    # The pose and velocity that are printed for 31.4 s.
    position, quaternion, twist = grasp_frame(study.target, study.motion(31.4))
    np.testing.assert_allclose(position, [2.489, 0.197, -1.010], atol=6e-4)
    np.testing.assert_allclose(twist[:3], [-0.013, 0.075, 0.027], atol=6e-4)
    np.testing.assert_allclose(twist[3:], [0.132, -0.008, 0.086], atol=8e-4)
    printed = Rotation.from_quat([0.761, -0.498, -0.294, -0.294], scalar_first=True)
    turned = printed.inv() * Rotation.from_quat(np.asarray(quaternion), scalar_first=True)
    assert np.rad2deg(turned.magnitude()) < 0.9


@pytest.mark.parametrize(
    ("overrides", "sentence"),
    [
        (
            ["kind=captur"],
            "found 'captur', 'planning', 'tracking', 'capture', 'reactionless' or 'chain' is expected; "
            "did you mean 'capture'?",
        ),
        (
            ["target.inertia=[1, 2]"],
            "target.inertia: found [1, 2], a list of 3 principal moments, or a matrix",
        ),
        (["target.inertia=[0.2, 0.3, 1]"], "triangle"),
        (["target.inertia=[[1, 2, 0], [0, 1, 0], [0, 0, 1]]"], "inertia is not symmetric"),
        (["target.positon=[1, 0, 0]"], "target.positon: unknown key; did you mean 'position'?"),
        (
            ["target.quaternion=[1, 1, 0, 0]"],
            "found [1.0, 1.0, 0.0, 0.0] of norm 1.414, (w, x, y, z) of norm 1",
        ),
        (["target.quaternion=[1, 0, 0, 0]", "target.rotation_vector_deg=[90, 0, 0]"], "keep one (or set"),
        (
            ["target.angular_velocity_deg=[1, 0, 0]"],
            "both 'angular_velocity_deg' and 'angular_velocity' are given",
        ),
        (["target.grasps=null"], "target.grasps: found null"),
        (["target.grasps.handle.position=[1, 2]"], "a list of 3 numbers is expected"),
        (["target.shapes=[{type: bx, size: [1, 1, 1]}]"], "did you mean 'box'?"),
        (["target.shapes=[{type: box, size: [1, 1]}]"], "a box needs 3 positive numbers"),
        (
            ["target.shapes=[]"],
            "target.shapes: found no shape that is kept clear of; give some, or set planner.margin",
        ),
        (["grasp=handel"], "grasp: found 'handel', 'handle' is expected; did you mean 'handle'?"),
        (["grasp_time.window=[40, 15]"], "a pair [first, last] in s with 0 <= first < last is expected"),
        (["grasp_time.window=[0, 15]"], "found a window from 0 on, a free time needs one that begins later"),
        (["grasp_time.time=fre"], "found 'fre', 'free' or 'criterion' is expected; did you mean 'free'?"),
        (["grasp_time.time=50"], "grasp_time.time: found 50, a time within the window [15, 40] is expected"),
        (["grasp_time.map=no_such.nc"], "grasp_time.map: no_such.nc: there is no such file"),
        (["planner.postures=9"], "planner.postures: found 9, at most the number of starts (6) is expected"),
        (["planner.cone_half_angle=2"], "a number in (0, 1.5707) rad is expected"),
        (["planner.ignore=[[link7, tool]]"], "planner.ignore: "),
        (
            ["objective.base_disturbance.enabled=false"],
            "objective: no term is enabled, at least one is expected",
        ),
        (["objective.lost_manipulability.measure=fore"], "did you mean 'force'?"),
        (["front.levels=1"], "front.levels: found 1, a whole number in [2, 100] is expected"),
        (
            ["observation.duration=5"],
            "in which 51 poses are measured; more than the acquisition's 100 are expected",
        ),
        (
            ["observation.camera.rate=0"],
            "observation.camera.rate: found 0, a number in (0, 1000] Hz is expected",
        ),
        (["robot=servicer_7"], "robot: "),
        (["task.start_deg=[0, 0]"], "found a list of 2, robot 'servicer_7dof' has 7 joints"),
        (["task.end_effector=hand"], "task.end_effector: found 'hand', robot 'servicer_7dof' has tool"),
    ],
)
def test_a_mistake_is_told_at_its_place(overrides, sentence):
    told = refused(*overrides)
    assert sentence in told
    assert told.startswith(("configs/capture/tumbling_box.yaml:", "override"))


def test_other_commands_say_what_they_are_for():
    with pytest.raises(
        InputError, match=r"found 'capture'; use 'jffsr run', or jffsr\.plan_capture in Python"
    ):
        plan(CONFIG)
    with pytest.raises(InputError, match="only planning studies are swept over"):
        expand(read_sweep(CONFIG, ["seed=1,2"]))


def test_a_front_is_told_with_its_chosen_solutions(tmp_path):
    plans = tuple(SimpleNamespace(free=np.full(4, float(k)), duration=20.0 + k) for k in range(3))
    values = np.array([[0.1, 0.3], [0.2, 0.6], [0.5, 0.8]])
    chosen = {"least_base_disturbance": 0, "least_lost_manipulability": 2, "balanced": 0}
    front = CaptureFront(plans, values, ("base_disturbance", "manipulability"), chosen)
    variables = front_variables(front)
    save_dataset(xr.Dataset(variables), tmp_path / "front.nc")
    dataset = open_dataset(tmp_path / "front.nc")
    np.testing.assert_array_equal(dataset["front_value"], values)
    names = ["least_base_disturbance, balanced", "", "least_lost_manipulability"]
    assert dataset["front_chosen"].values.tolist() == names
    assert dataset["front_duration"].values.tolist() == [20.0, 21.0, 22.0]
    told = front_summary(front)
    assert told["solutions"] == 3
    assert told["chosen"]["least_lost_manipulability"] == {
        "number": 2,
        "values": {"base_disturbance": 0.5, "manipulability": 0.8},
        "duration": 22.0,
    }
