"""The folder of a run: whose it is, whether it is finished, and what goes into it.

config.yaml (resolved), robot/ (the files of a robot that is not of the catalogue), summary.json (written last: its
presence says that the run is finished), result.nc, metrics.jsonl (a line a chunk), figures/, and, while the run is
under way, checkpoint.npz.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from jffsr.errors import InputError
from jffsr.reading.did_you_mean import hint
from jffsr.reading.files import folders_beside
from jffsr.study.atomic import plain, write_text
from jffsr.study.config import Study, dump_config, load_config
from jffsr.study.robot_files import RobotFiles, robot_files

MAP = "capability_map"


class RunFolder:
    """Paths of a run folder and the small files in it."""

    def __init__(self, path: Path):
        self.path = path

    @property
    def config(self) -> Path:
        """The resolved configuration."""
        return self.path / "config.yaml"

    @property
    def summary(self) -> Path:
        """The summary, written when the run is finished."""
        return self.path / "summary.json"

    @property
    def result(self) -> Path:
        """The labelled arrays."""
        return self.path / "result.nc"

    @property
    def metrics(self) -> Path:
        """One line of JSON a chunk."""
        return self.path / "metrics.jsonl"

    @property
    def checkpoint(self) -> Path:
        """The snapshot of a search under way."""
        return self.path / "checkpoint.npz"

    @property
    def figures(self) -> Path:
        """The folder of the figures."""
        return self.path / "figures"

    @property
    def finished(self) -> bool:
        """Whether the run has come to its end."""
        return self.summary.is_file()

    def read_summary(self) -> dict[str, Any]:
        """The summary of a finished run; InputError when it is not there or damaged."""
        try:
            return json.loads(self.summary.read_text(encoding="utf-8"))
        except NotADirectoryError:
            raise InputError(f"{self.path}: is a file; give the folder of a run") from None
        except FileNotFoundError:
            if not self.path.is_dir():
                raise InputError(
                    f"{self.path}: there is no such folder{hint(self.path.name, folders_beside(self.path))}"
                ) from None
            raise InputError(f"{self.path}: not a finished run (no summary.json)") from None
        except (OSError, ValueError) as error:
            raise InputError(f"{self.summary}: cannot be read ({error})") from None

    def read_config(self) -> Study:
        """The resolved configuration of the run."""
        if not self.path.is_dir():
            raise InputError(f"{self.path}: there is no such run folder")
        if not self.config.is_file():
            raise InputError(f"{self.path}: not a run folder (no config.yaml)")
        return load_config(self.config)

    def keep_metrics(self, evaluations: int, gradient_evaluations: int) -> None:
        """Drop the lines past these counts, which a checkpoint does not know of, and a last half line."""
        if not self.metrics.is_file():
            return
        kept = []
        for line in self.metrics.read_text(encoding="utf-8", errors="replace").splitlines():
            try:
                row = json.loads(line)
                if row["evaluations"] > evaluations or row["gradient_evaluations"] > gradient_evaluations:
                    break
            except (ValueError, KeyError, TypeError):
                break
            kept.append(line + "\n")
        write_text(self.metrics, "".join(kept))

    def add_metrics(self, **values: Any) -> None:
        """Append a line to the metrics."""
        with open(self.metrics, "a", encoding="utf-8") as file:
            file.write(json.dumps(plain(values)) + "\n")


def claim_run_folder(config: Study, out: str | Path | None) -> RunFolder:
    """The folder of this configuration's run: a new one, or the one to go on in.

    Without `out`, the first free of runs/NAME, runs/NAME-2, ... . InputError where `out` belongs to another
    configuration, or is not a run folder, or cannot be written.
    """
    path = free_name(Path("runs"), config.name) if out is None else Path(out)
    folder = RunFolder(path)
    carried, config = carried_files(config)
    text = dump_config(config)
    if path.is_dir() and any(path.iterdir()):
        if not folder.config.is_file():
            raise InputError(f"--out {path}: the folder is not empty and holds no run; give another")
        if folder.config.read_text(encoding="utf-8") != text:
            raise InputError(
                f"--out {path}: the folder holds a run of another configuration; give another folder, or repeat it "
                f"with 'jffsr run {folder.config}'"
            )
    try:
        path.mkdir(parents=True, exist_ok=True)
        if not folder.config.is_file():
            write_text(folder.config, text)
        carried.write(path)
    except OSError as error:
        raise InputError(f"--out {path}: cannot be written ({error.strerror or error})") from None
    return folder


def carried_files(config: Study) -> tuple[RobotFiles, Study]:
    """The files of the study's robot and its capability map, and the study with their places in its folder."""
    carried = robot_files([config.robot])
    changes: dict[str, Any] = {"robot": carried.names.get(config.robot, config.robot)}
    when = getattr(config, "grasp_time", None)
    if when is not None and when.map is not None:
        name = MAP + Path(when.map).suffix
        carried = RobotFiles(carried.names, {**carried.files, name: Path(when.map).read_bytes()})
        changes["grasp_time"] = when.model_copy(update={"map": name})
    return carried, config.model_copy(update=changes)


def free_name(parent: Path, name: str) -> Path:
    candidate, number = parent / name, 1
    while candidate.exists():
        number += 1
        candidate = parent / f"{name}-{number}"
    return candidate
