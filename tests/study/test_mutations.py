"""500 damaged copies of the shipped files: each ends as a plan or as one sentence, soon, and never as a defect."""

from __future__ import annotations

import random
from importlib import resources
from pathlib import Path

import jax
import pytest
from mutations import mutate
from time_limit import within

from jffsr import cli
from jffsr.errors import InputError
from jffsr.study.building import build_problem
from jffsr.study.config import load_config

CONFIGS = sorted(Path("configs/planning").glob("*.yaml"))
DATA = Path(str(resources.files("jffsr.robots") / "data"))
PLANAR = """
kind: planning
robot: ROBOT
limits: {position_deg: 100, rate: 0.3, acceleration: 0.2}
task: {start_deg: START, goal_deg: GOAL, duration: 20}
"""
# A robot's study is a shipped one where there is one, so that the two share their compiled programs.
STUDIES = {
    "hu_2011_planar2": PLANAR.replace("START", "[10, 10]").replace("GOAL", "[20, 20]"),
    "ye_2019_planar3": PLANAR.replace("START", "[10, 10, 10]").replace("GOAL", "[20, 20, 20]"),
    "wu_2018_6dof": Path("configs/planning/composite_wu6.yaml").read_text().replace("wu_6dof", "ROBOT"),
    "servicer_7dof": Path("configs/planning/composite_7dof.yaml")
    .read_text()
    .replace("servicer_7dof", "ROBOT"),
}
# These robots have every form that a file can take; each further one would have to be compiled anew.
ROBOTS = [DATA / f"{name}.yaml" for name in sorted(STUDIES)]
SHARES = 10
SECONDS = 5.0


@pytest.fixture(scope="module")
def compiled():
    """Structures of the problems that have been run: another one first has to be compiled."""
    return set()


def structure(problem):
    return jax.tree.structure(problem), tuple(jax.numpy.shape(x) for x in jax.tree.leaves(problem))


def damaged(number: int, folder: Path) -> Path:
    """The study with the seeded damage `number`: in its own file, or in its robot's."""
    rng = random.Random(number)
    config, robot = rng.choice(CONFIGS), None
    if number % 3 == 0:
        robot = folder / "robot.yaml"
        source = rng.choice(ROBOTS)
        robot.write_text(mutate(source.read_text(encoding="utf-8"), rng), encoding="utf-8")
        text = STUDIES[source.stem].replace("ROBOT", str(robot))
    else:
        for shipped in CONFIGS:
            (folder / shipped.name).write_text(shipped.read_text(encoding="utf-8"), encoding="utf-8")
        text = mutate(config.read_text(encoding="utf-8"), rng)
    path = folder / "study.yaml"
    path.write_bytes(text.encode("utf-8", "replace"))
    return path


def test_damaged_files_are_read_or_refused_in_a_sentence(small, tmp_path):
    """A fifth of those that are run below, which would have to be compiled."""
    built, said = 0, []
    for number in range(0, 500, 5):
        folder = tmp_path / str(number)
        folder.mkdir()
        path = damaged(number, folder)
        try:
            with within(SECONDS):
                build_problem(load_config(path, small))
        except InputError as error:
            said.append(str(error))
        else:
            built += 1
    assert min(built, len(said)) > 20
    assert not any("\n" in sentence for sentence in said)


@pytest.mark.slow
@pytest.mark.parametrize("share", range(SHARES))
def test_damaged_files_end_well(share, small, compiled, tmp_path, capsys):
    ended = {cli.MET: 0, cli.BAD_INPUT: 0, cli.NOT_MET: 0}
    for number in range(share, 500, SHARES):
        folder = tmp_path / str(number)
        folder.mkdir()
        path = damaged(number, folder)
        # Every structure has to be compiled: without gradients, that is much cheaper.
        kind = "optimizer.kind=hybrid" if number % 10 == 1 else "optimizer.kind=qpso"
        overrides = [*small, kind, "optimizer.evaluations=16"]
        arguments = ["run", str(path), *overrides, "--out", str(folder / "run")]
        seconds = SECONDS
        try:
            with within(SECONDS):
                problem = build_problem(load_config(path, overrides))
        except InputError:
            pass
        else:
            if (kind, structure(problem)) not in compiled:
                compiled.add((kind, structure(problem)))
                seconds = 300.0
        with within(seconds):
            status = cli.main(arguments)
        said = capsys.readouterr()
        assert status in ended, f"mutation {number}: exit {status}\n{said.err}"
        if status == cli.BAD_INPUT:
            assert said.err.startswith("jffsr: "), f"mutation {number}: {said.err}"
            assert said.err.count("\n") == 1, f"mutation {number}: {said.err}"
        ended[status] += 1
    assert ended[cli.BAD_INPUT] > 0
    assert sum(ended.values()) == 500 // SHARES
