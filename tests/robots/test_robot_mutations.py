"""Seeded damage to robot files: none crashes, hangs, or loads as another robot than the file describes."""

from __future__ import annotations

import contextlib
import random
import re
import time
from pathlib import Path

import numpy as np
import plain_reading
import pytest
import xml_mutations
from loading_guard import attempt
from robot_texts import DATA, MJCF, URDF
from time_limit import within

import jffsr


def originals():
    """Sound files: oracle files, realistic ones, the catalogue, and what is exported of it."""
    found = [
        (".urdf", (DATA / "oracle" / f"{name}.urdf").read_text(encoding="utf-8"))
        for name in ("wu6", "planar2")
    ]
    # The raw file is MuJoCo's to read too, which would miss the texture.
    whole = MJCF.replace('file="foil_that_is_not_there.png"', 'builtin="flat" width="8" height="8"')
    found += [(".urdf", URDF), (".xml", whole), (".xml", whole)]
    catalogue = Path(jffsr.__file__).parent / "robots" / "data"
    for path in [*sorted(catalogue.glob("*.yaml")), *sorted((DATA / "robots").glob("*.yaml"))]:
        text = path.read_text(encoding="utf-8")
        # Robots made of robots are damaged in a test of their own.
        if "\narms:" not in text:
            found.append((".yaml", text))
    for name in ("wu_2018_6dof", "servicer_7dof", DATA / "robots" / "two_arms.yaml"):
        robot = jffsr.load_robot(name)
        found += [(".urdf", jffsr.to_urdf(robot)), (".xml", jffsr.to_mjcf(robot))]
    return found


def says(path: Path, text: str, robot) -> plain_reading.Snapshot | None:
    """What a plain second reader finds in the file."""
    if path.suffix == ".yaml":
        return plain_reading.of_yaml(text, robot.body_names[0])
    if path.suffix == ".urdf":
        return plain_reading.of_urdf(text, robot.body_names[0])
    return plain_reading.of_mjcf(path)


def check_mutations(folder: Path, numbers) -> dict[str, int]:
    """Damage, load, compare; how many ended in which way."""
    sound, ended = originals(), {"refused": 0, "as it says": 0, "no second reader": 0}
    elsewhere = folder / "elsewhere"
    elsewhere.mkdir()
    for number in numbers:
        rng = random.Random(number)
        suffix, text = rng.choice(sound)
        damaged, kind = xml_mutations.mutate(text, rng)
        path = folder / f"mutant{suffix}"
        path.write_bytes(damaged.encode("utf-8", "replace"))
        label = f"mutation {number} ({kind})"
        robot, error = attempt(path)
        if robot is None:
            assert path.name in error, f"{label}: {error}"
            assert "\n" not in error, f"{label}: {error}"
            ended["refused"] += 1
            continue
        # MuJoCo, as the second reader, may leave its log file where it works.
        with contextlib.chdir(elsewhere):
            expected = says(path, damaged.encode("utf-8", "replace").decode("utf-8-sig"), robot)
        if expected is None:
            ended["no second reader"] += 1
        else:
            plain_reading.assert_same(plain_reading.of_robot(robot), expected, label)
            ended["as it says"] += 1
    assert not (folder / "MUJOCO_LOG.TXT").exists()
    return ended


def test_sound_files_are_what_the_second_reader_says(folder):
    """The comparison that the mutations rest on, and that it would see a difference."""
    for number, (suffix, text) in enumerate(originals()):
        path = folder / f"sound{number}{suffix}"
        path.write_text(text, encoding="utf-8")
        robot = jffsr.load_robot(path)
        expected = says(path, text, robot)
        plain_reading.assert_same(plain_reading.of_robot(robot), expected, path.name)
        for change in ("mass", "link_com", "joint_position", "joint_axis", "inertia"):
            leaf = np.array(getattr(robot, change))
            leaf[-1] = leaf[-1] * 1.001 if change != "joint_axis" else leaf[-1][::-1] * [1, -1, 1]
            if not leaf[-1].any() or np.array_equal(leaf, getattr(robot, change)):
                continue
            other = plain_reading.of_robot(robot.replace(**{change: leaf}))
            if change == "joint_position" and not robot.topology.is_revolute[-1]:
                continue
            with pytest.raises(AssertionError):
                plain_reading.assert_same(other, expected, path.name)


@pytest.mark.parametrize("share", [0, *(pytest.param(k, marks=pytest.mark.slow) for k in (1, 2, 3, 4))])
def test_a_thousand_mutations_end_well(folder, share):
    ended = check_mutations(folder, range(share, 1000, 5))
    assert ended["refused"] >= 100
    assert ended["as it says"] >= 30
    assert ended["no second reader"] <= 12


@pytest.mark.slow
@pytest.mark.parametrize("share", range(5))
def test_ten_thousand_more_mutations_end_well(folder, share):
    ended = check_mutations(folder, range(1000 + share, 11_000, 5))
    assert ended["as it says"] >= 300


TAG = re.compile(r"<(/?)(\w+)([^<>]*?)(/?)>")


def owner(text: str, at: int) -> str | None:
    """The name of the innermost link, joint or body that a place in a sound text is in."""
    inside = []
    for tag in TAG.finditer(text):
        if tag.start() > at:
            break
        if tag.group(1):
            inside.pop()
            continue
        name = re.search(r'\bname="([^"]*)"', tag.group(3))
        inside.append((tag.group(2), name and name.group(1)))
        if tag.group(4) and tag.end() <= at:
            inside.pop()
    named = [name for kind, name in inside if kind in ("link", "joint", "body") and name]
    return named[-1] if named and inside[1][0] in ("link", "joint", "worldbody") else None


@pytest.mark.parametrize("share", range(2))
def test_a_junk_number_is_blamed_on_what_it_stands_in(folder, share):
    sound = [item for item in originals() if item[0] != ".yaml"]
    refused = 0
    for number in range(share, 160, 2):
        rng = random.Random(number)
        suffix, text = rng.choice(sound)
        damaged, at = xml_mutations.damage_value(text, rng)
        blamed = owner(text, at)
        path = folder / f"blamed{suffix}"
        path.write_text(damaged, encoding="utf-8")
        robot, error = attempt(path)
        if robot is None and blamed is not None:
            refused += 1
            assert f"'{blamed}'" in error, f"{number}: {damaged[at - 80 : at + 80]}: {error}"
    assert refused >= 20


def test_the_guard_against_hangs_works():
    with pytest.raises(TimeoutError, match=r"took over 0\.05 s"), within(0.05):
        time.sleep(5)
