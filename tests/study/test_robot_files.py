"""A run's or sweep's folder carries the robot's files, and can be moved, shared and gone on with."""

from __future__ import annotations

import shutil
from html import escape
from pathlib import Path

import numpy as np
import pytest
from composed_files import RIGHT, STUDY, TWINS

from jffsr.errors import InputError
from jffsr.robots.loading import load_robot
from jffsr.study.config import load_config
from jffsr.study.run_folder import RunFolder, claim_run_folder
from jffsr.study.sweep.folder import claim_sweep_folder
from jffsr.study.sweep.specification import read_sweep
from jffsr.viz.report.report import _robot

CAPTURE = next((Path(__file__).parents[2] / "configs" / "capture").glob("tumbling*.yaml"))
ARM = """\
<robot name="arm">
  <link name="bus"><inertial><mass value="90"/>
    <inertia ixx="9" ixy="0" ixz="0" iyy="9" iyz="0" izz="9"/></inertial></link>
  <link name="rod"><inertial><mass value="2"/>
    <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>
    <visual><geometry><mesh filename="package://arms/meshes/rod.obj"/></geometry></visual></link>
  <joint name="hinge" type="revolute"><parent link="bus"/><child link="rod"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" effort="5" velocity="0.2"/></joint>
</robot>
"""
ROD = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
TASK = "kind: planning\nrobot: arm.urdf\ntask: {start_deg: [10], goal_deg: [20], duration: 20}\n"
FILES = {
    "robots/twins.yaml": TWINS,
    "arms/right.yaml": RIGHT,
    "studies/study.yaml": STUDY,
    "arms/urdf/arm.urdf": ARM,
    "arms/meshes/rod.obj": ROD,
    "arms/urdf/task.yaml": TASK,
    "arms/urdf/twice.yaml": "kind: sweep\nbase: task\ngrid: {robot: [arm.urdf, ../../robots/twins.yaml]}\n",
}


@pytest.fixture
def project(tmp_path):
    """A project's folder, to be deleted before what came out of it is looked at."""
    for name, text in FILES.items():
        path = tmp_path / "project" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return tmp_path / "project"


def elsewhere(tmp_path, project):
    """The run folder as it is found on another machine: another place, and nothing of the project there."""
    shutil.move(tmp_path / "run", tmp_path / "shared" / "run")
    shutil.rmtree(project)
    return tmp_path / "shared" / "run"


def test_a_folder_is_read_where_the_robots_file_is_not(tmp_path, project):
    """A composed robot comes with the files of its arms, a URDF with its meshes, each as it was read."""
    before = load_robot(project / "robots" / "twins.yaml")
    claim_run_folder(load_config(project / "studies" / "study.yaml"), tmp_path / "run")
    found = elsewhere(tmp_path, project)
    written = sorted(path.relative_to(found).as_posix() for path in found.rglob("*") if path.is_file())
    assert written == ["config.yaml", "robot/arms/right.yaml", "robot/robots/twins.yaml"]
    assert str(tmp_path) not in (found / "config.yaml").read_text()
    after = load_robot(RunFolder(found).read_config().robot)
    np.testing.assert_array_equal(after.inertia, before.inertia)
    assert after.joint_names == before.joint_names


def test_meshes_come_along(tmp_path, project):
    claim_run_folder(load_config(project / "arms" / "urdf" / "task.yaml"), tmp_path / "run")
    found = elsewhere(tmp_path, project)
    robot = load_robot(RunFolder(found).read_config().robot)
    (mesh,) = (shape for shape in robot.geometry.shapes if shape.kind == "mesh")
    np.testing.assert_allclose(np.max(np.asarray(mesh.vertices), axis=0), 1, atol=1e-6)  # read in 32 bits


def test_a_robot_of_the_catalogue_is_named(tmp_path, project):
    config = load_config(project / "arms" / "urdf" / "task.yaml", ["robot=hu_planar2"])
    claim_run_folder(config, tmp_path / "run")
    assert [path.name for path in (tmp_path / "run").iterdir()] == ["config.yaml"]
    assert RunFolder(tmp_path / "run").read_config() == config


def test_a_run_goes_on_with_the_same_robot_alone(tmp_path, project):
    """From the project's configuration and from the folder's own; never with a robot that has changed since."""
    task, out = project / "arms" / "urdf" / "task.yaml", tmp_path / "run"
    claim_run_folder(load_config(task), out)
    text = (out / "config.yaml").read_text()
    claim_run_folder(load_config(out / "config.yaml"), out)
    (out / "robot" / "meshes" / "rod.obj").unlink()  # as a kill in the middle of writing leaves it
    claim_run_folder(load_config(task), out)
    assert (out / "robot" / "meshes" / "rod.obj").read_text() == ROD
    assert (out / "config.yaml").read_text() == text
    (project / "arms" / "urdf" / "arm.urdf").write_text(ARM.replace('"90"', '"91"'))
    with pytest.raises(
        InputError, match=r"'robot/urdf/arm\.urdf' there is not the study's file as it is now"
    ):
        claim_run_folder(load_config(task), out)
    assert "90" in (out / "robot" / "urdf" / "arm.urdf").read_text()


def test_a_capability_map_comes_along(tmp_path, project):
    """Its path is relative to the study's file, and on the command line to the current folder."""
    (project / "maps").mkdir()
    (project / "maps" / "arm.nc").write_bytes(b"a map")
    study = project / "studies" / "capture.yaml"
    study.write_text(f"defaults: [{CAPTURE}]\ngrasp_time: {{map: ../maps/arm.nc}}\n")
    config = load_config(study)
    assert config.grasp_time.map == str(project / "maps" / "arm.nc")
    claim_run_folder(config, tmp_path / "run")
    found = RunFolder(elsewhere(tmp_path, project)).read_config()
    assert Path(found.grasp_time.map) == tmp_path / "shared" / "run" / "capability_map.nc"
    assert Path(found.grasp_time.map).read_bytes() == b"a map"
    here = load_config(CAPTURE, ["grasp_time.map=maps/other.nc"])
    assert Path(here.grasp_time.map) == Path.cwd() / "maps" / "other.nc"


def test_a_sweep_carries_every_robot(tmp_path, project):
    spec = read_sweep(str(project / "arms" / "urdf" / "twice.yaml"))
    masses = [float(load_robot(robot).mass.sum()) for robot in spec.robots]
    claim_sweep_folder(spec, tmp_path / "run")
    found = elsewhere(tmp_path, project)
    assert str(tmp_path) not in (found / "config.yaml").read_text()
    again = read_sweep(str(found / "config.yaml"))
    assert [float(load_robot(robot).mass.sum()) for robot in again.robots] == masses
    assert len(again.robots) == 3
    claim_sweep_folder(again, found)  # goes on where it lies now


def test_a_report_holds_the_robot(tmp_path, project):
    """Its numbers and its file's text, so that a motion can be made again from the page alone."""
    claim_run_folder(load_config(project / "arms" / "urdf" / "task.yaml"), tmp_path / "run")
    found = _robot(RunFolder(elsewhere(tmp_path, project)))
    assert escape(ARM.strip().splitlines()[0]) in found
    assert "robot/urdf/arm.urdf" in found
    assert "end effectors: " in found
    assert str(tmp_path) not in found
