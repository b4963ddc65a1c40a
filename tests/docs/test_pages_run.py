"""The Python of every page runs as it stands, each page in a process of its own, in a folder of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from documentation import NAMES, ROOT, blocks, blocks_of

X64 = "import jax, numpy as np\nimport jffsr\njax.config.update('jax_enable_x64', True)\n"
PLANAR = (
    X64
    + """
robot = jffsr.load_robot("hu_2011_planar2")
start, goal = np.deg2rad([[90.0, 30.0], [-60.0, 90.0]])
bound = np.full(2, np.deg2rad(324))
trajectory = jffsr.SinePolynomial.between(start, goal, -bound, bound, duration=20.0)
index = jffsr.composite_index(robot, joint_goal=goal)
problem = jffsr.Problem(robot, trajectory, index, num_steps=40)
"""
)
SWEPT = """
from jffsr.cli import main
points = ["optimizer.kind=qpso,gradient", "task.duration=25,30", "optimizer.evaluations=100"]
small = ["optimizer.gradient_iterations=2", "optimizer.polish_iterations=2", "seeds=2"]
assert main(["sweep", "composite_wu6", *points, *small, "--out", "runs/durations"]) in (0, 3)
"""
TARGET = (
    X64
    + """
position, quaternion = np.array([-0.1, 0.0, 0.2]), np.array([1.0, 0.0, 0.0, 0.0])
rate = np.deg2rad([1.0, 0.5, -0.5])
"""
)
CONTACT = (
    X64
    + """
robot = jffsr.load_robot("ye_planar3")
unit = np.array([1.0, 0.0, 0.0, 0.0])
state = jffsr.State(np.zeros(3), unit, np.array([0.4, 0.8, -0.6]))
place, attitude = jffsr.end_effector_pose(robot, jffsr.kinematics(robot, state))
target = jffsr.Target.create((2.0, 2.5, 3.0), 5.0)
target_state = jffsr.TargetState.create(place + np.array([0.1, 0.0, 0.0]), (-0.01, 0.0, 0.0), attitude, (0.0, 0.0, 0.5))
"""
)
RUN = """
from jffsr.cli import main
small = ["optimizer.evaluations=100", "optimizer.gradient_iterations=2", "verification.sensitivity=false"]
assert main(["run", "composite_wu6", *small, "--out", "runs/composite_wu6"]) in (0, 3)
"""
CAPTURE = (
    X64
    + """
from jffsr.robots.geometry import BOX, Geometry, Shape


def box(body, x, half):
    return Shape(body, BOX, body, np.array([x, 0.0, 0.0]), np.eye(3), np.array(half))


bus = jffsr.RigidBody.create(mass=1000.0, inertia=[300.0, 300.0, 300.0], name="bus")
robot = jffsr.attach(bus, jffsr.load_robot("ye_planar3"), arm_base="drop")
limits = jffsr.Limits.symmetric(position=np.deg2rad(140), velocity=0.15, acceleration=0.05, num_joints=3)
bodies = box(robot.body_names[0], 0.0, [0.3] * 3), box(robot.body_names[2], 0.2, [0.2, 0.04, 0.04])
robot = robot.replace(limits=limits, geometry=Geometry(bodies))
unit = np.array([1.0, 0, 0, 0])
state = jffsr.State(np.zeros(3), unit, np.array([1.8, -2.2, 0.9]))
grasps, shapes = {"handle": ((-0.4, 0.1, 0.0), unit)}, Geometry((box("target", 0.0, [0.3] * 3),))
target = jffsr.Target.create((2.0, 2.5, 3.0), 10.0, grasps=grasps, geometry=shapes)
seen = jffsr.TargetState.create((3.4, 0.7, 0.0), (-0.005, 0.005, 0.0), unit, (0.0, 0.0, 0.02))
motion = jffsr.target_motion(target, seen, duration=61.0)
"""
)
# What a block takes from the text before it, by page and number: it runs before the block.
BEFORE = {
    ("docs/how-to/plan_for_uncertain_robots.md", 1): PLANAR,
    ("docs/how-to/see_and_share.md", 1): RUN,
    ("docs/how-to/sweep.md", 1): SWEPT,
    ("docs/how-to/use_all_cores_and_machines.md", 3): "problems = [problem, problem]\n",
    ("docs/theory/capture.md", 1): CAPTURE,
    ("docs/theory/capture.md", 3): "true_path, what_the_filter_says = path, [(6.0, path, model)]\n",
    ("docs/theory/capture.md", 4): CONTACT,
    ("docs/theory/tumbling_target.md", 1): TARGET,
}
# Pages that a test of their own runs, with what it knows of their results.
OWN_TEST = {
    "docs/how-to/build_a_capability_map.md": "tests/capture/test_capability_page.py",
    "docs/how-to/compose_a_robot.md": "tests/robots/test_compose_page.py",
    "docs/how-to/find_singularities.md": "tests/tracking/test_singularity_page.py",
    "docs/how-to/hold_the_base_still.md": "tests/reactionless/test_hold_page.py",
    "docs/how-to/keep_clear.md": "tests/clearance/test_keep_clear_page.py",
    "docs/how-to/load_a_robot.md": "tests/robots/test_load_page.py",
    "docs/how-to/track_a_path.md": "tests/tracking/test_track_page.py",
}
LIMIT = 2400.0
"""s; the captures of the theory page and the 64 robots in MJX take minutes each."""


def place(block) -> tuple[str, int]:
    return block.page, block.number


def runnable(page: str) -> list:
    """The Python blocks of a page that run here; what an example's script shows is run by its own test."""
    return [b for b in blocks(page) if b.kind == "python" and "__main__" not in b.text]


RUN_HERE = [page for page in NAMES if runnable(page) and page not in OWN_TEST]


def test_every_block_is_run_somewhere():
    python = {place(block) for block in blocks_of("python")}
    assert set(BEFORE) <= python
    for page, test in OWN_TEST.items():
        assert Path(page).name in (ROOT / test).read_text(encoding="utf-8")
    scripts = [block for block in blocks_of("python") if "__main__" in block.text]
    examples = [
        path.read_text(encoding="utf-8").rstrip() for path in (ROOT / "docs" / "examples").glob("*.py")
    ]
    assert all(block.text.rstrip() in examples for block in scripts)
    here = {place(block) for page in RUN_HERE for block in runnable(page)}
    elsewhere = {place(block) for block in blocks_of("python") if block.page in OWN_TEST}
    assert here | elsewhere | {place(block) for block in scripts} == python


@pytest.mark.docs
@pytest.mark.parametrize("page", RUN_HERE)
def test_the_python_of_a_page_runs(page, tmp_path):
    for block in blocks(page):
        if block.saved_as:
            (tmp_path / block.saved_as).write_text(block.text, encoding="utf-8")
    text = "\n\n".join(BEFORE.get(place(block), "") + block.text for block in runnable(page))
    (tmp_path / "page.py").write_text(text, encoding="utf-8")
    run = subprocess.run(
        [sys.executable, "page.py"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT), "MPLBACKEND": "agg"},
        capture_output=True,
        text=True,
        check=False,
        timeout=LIMIT,
    )
    assert run.returncode == 0, run.stderr[-3000:]
