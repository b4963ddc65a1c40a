"""What `jffsr robots FILE` prints of a robot of one's own."""

from __future__ import annotations

from pathlib import Path

from jffsr.study.catalogue import robot_text

ROBOTS = Path(__file__).parents[1] / "data" / "robots"


def test_a_robots_masses_can_be_compared_with_ones_own():
    """The numbers of the test's URDF: what is fixed is lumped, and B is at the bus's own centre of mass."""
    lines = robot_text(str(ROBOTS / "satellite.urdf"), 120).splitlines()
    assert ["in", "all", "91.9"] in [line.split() for line in lines]
    assert "lumped into the body that they are fixed to: world, lidar, gripper, camera" in lines
    assert (
        "base frame B: at the base's centre of mass, (0.02, -0.01, 0.05) m in link 'bus', along its axes"
        in lines
    )
