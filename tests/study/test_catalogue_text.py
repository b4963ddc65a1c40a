"""What `jffsr robots FILE` prints of a robot of one's own."""

from __future__ import annotations

import re
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


def test_the_pairs_that_a_clearance_looks_at_are_named():
    """Neighbours are left out: of three bodies in a row one pair is left."""
    text = robot_text("hu_2011_planar2", 120)
    assert "pairs that constraints.clearance looks at: 1: base and link2" in text
    many = robot_text("dual_arm_servicer", 120)
    assert re.search(r"looks at: 91: (?s:.)*, and 76\s+more", many)
