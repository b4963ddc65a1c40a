"""The files of a study's robots, carried along in its folder, so that the folder can be moved and shared."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from jffsr.errors import InputError
from jffsr.reading.files import what_is_read
from jffsr.robots.loading import describe_robot
from jffsr.study.atomic import write_bytes

FOLDER = "robot"


@dataclass(frozen=True)
class RobotFiles:
    """What robots are read from: their files, those of their arms, what these include, and their meshes.

    names: of each robot's path, what it is called in a configuration within the folder; files: content by place,
    relative to that folder. Files lie to each other as they did, below the folder that they had in common.
    """

    names: dict[str, str]
    files: dict[str, bytes]

    def write(self, folder: Path) -> None:
        """Write into a study's folder what is not there yet, each file whole or not at all.

        Raises InputError where a file is there already with other content: the robot has changed since. OSError where
        the folder cannot be written.
        """
        for name, content in self.files.items():
            path = folder / name
            if not path.is_file():
                path.parent.mkdir(parents=True, exist_ok=True)
                write_bytes(path, content)
            elif path.read_bytes() != content:
                raise InputError(
                    f"--out {folder}: '{name}' there is not the study's file as it is now, and what is in the folder "
                    f"was computed with the one there; give another folder"
                )


def robot_files(robots: Iterable[str]) -> RobotFiles:
    """The files of those robots that a composed configuration names by path; a catalogue's name has none.

    Raises InputError where a robot cannot be read.
    """
    paths = list(dict.fromkeys(robot for robot in robots if os.path.isabs(robot)))
    with what_is_read() as read:
        for path in paths:
            describe_robot(path)
    if not read:
        return RobotFiles({}, {})
    above = os.path.commonpath([os.path.dirname(path) for path in read])

    def place(path: str) -> str:
        return (Path(FOLDER) / os.path.relpath(path, above)).as_posix()

    return RobotFiles(
        {path: place(os.path.abspath(path)) for path in paths},
        {place(path): content for path, content in read.items()},
    )
