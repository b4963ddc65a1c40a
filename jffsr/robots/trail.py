"""The way from one robot file to the robots of its arms: relative paths, circles, and how much is read."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from jffsr.errors import InputError
from jffsr.robots.description import RobotDescription

MAX_LEVELS = 10
MAX_ROBOTS = 100
_FILE_ENDINGS = (".yaml", ".yml", ".urdf", ".xml", ".mjcf")


@dataclass
class _Count:
    robots: int = 0


@dataclass(frozen=True)
class Trail:
    """The robots that led here, as they are called in messages and as what tells them apart."""

    names: tuple[str, ...] = ()
    keys: tuple[str, ...] = ()
    count: _Count = field(default_factory=_Count)

    def arms_of(
        self, name: str, key: str, folder: str | Path, describe: Callable[[str, Trail], RobotDescription]
    ) -> Callable[[str], RobotDescription]:
        """What finds the robots of the arms of one robot: by name, or by a path relative to its folder.

        InputError when that robot already stands on the trail, or the trail gets too long.
        """
        names = (*self.names, name)
        if key in self.keys:
            raise InputError(f"the robots are made of each other in a circle ({' -> '.join(names)})")
        if len(names) > MAX_LEVELS:
            raise InputError(f"robots are made of robots more than {MAX_LEVELS} levels deep")
        below = Trail(names, (*self.keys, key), self.count)

        def find(robot: str) -> RobotDescription:
            self.count.robots += 1
            if self.count.robots > MAX_ROBOTS:
                raise InputError(f"the robot is made of more than {MAX_ROBOTS} robots")
            if "/" in robot or robot.lower().endswith(_FILE_ENDINGS):
                robot = str(Path(folder) / os.path.expanduser(robot))
            return describe(robot, below)

        return find
