"""Settings of an optimizer that are given and change nothing are told, once and with their place."""

from __future__ import annotations

import pytest

from jffsr.optimizers.registry import Settings
from jffsr.optimizers.unused import unused_settings
from jffsr.study.config import load_config
from jffsr.study.sweep.points import expand
from jffsr.study.sweep.specification import read_sweep
from jffsr.study.unused import unused_keys

CONFIG = "configs/planning/composite_wu6.yaml"


def notes(*overrides: str) -> list[str]:
    return list(unused_keys([load_config(CONFIG, overrides)]))


def swept(*arguments: str) -> list[str]:
    return list(unused_keys(point.config for point in expand(read_sweep(CONFIG, arguments))))


@pytest.mark.parametrize(
    ("kind", "changes", "unused"),
    [
        ("hybrid", {"evaluations": 900}, ("evaluations",)),
        ("hybrid", {"swarm_evaluations": 900, "starts": 3}, ()),
        ("qpso", {"swarm_evaluations": 900, "starts": 3}, ("swarm_evaluations", "starts")),
        ("gradient", {"particles": 60, "starts": 3, "contraction": (0.9, 0.4)}, ("particles", "contraction")),
        # Without this one there would be fewer evaluations than particles, and no search.
        ("qpso", {"particles": 30_000, "evaluations": 40_000}, ()),
        ("hybrid", {}, ()),
    ],
)
def test_what_makes_no_difference_is_found(kind, changes, unused):
    assert unused_settings(kind, Settings(**changes)) == unused


def test_a_study_says_where_it_stands():
    assert notes("optimizer.evaluations=900", "optimizer.starts=3") == [
        "override 'optimizer.evaluations=900': optimizer.evaluations: given, but 'hybrid' does not use it"
    ]
    assert notes("optimizer.swarm_evaluations=900") == []


def test_a_sweep_says_once_what_none_of_its_points_uses():
    (note,) = swept("optimizer.evaluations=900,1000,20000")
    assert note.endswith("optimizer.evaluations: given, but 'hybrid' does not use it")
    assert swept("optimizer.kind=hybrid,qpso", "optimizer.evaluations=900") == []
    (note,) = swept("optimizer.kind=de,qpso", "optimizer.swarm_evaluations=900")
    assert note.endswith("optimizer.swarm_evaluations: given, but 'de' and 'qpso' do not use it")


def test_a_tuning_of_a_tracker_has_its_own():
    section = "{parameters: {epsilon: [0.01, 0.1]}, rate_limit_deg: 6, optimizer: {evaluations: 900}}"
    (note,) = unused_keys([load_config("wu_2018", [f"tuning={section}"])], "tuning.optimizer")
    assert note.endswith("tuning.optimizer.evaluations: given, but 'hybrid' does not use it")
