"""What a sweep's file and the command line make of points, and what they refuse before anything runs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from config_files import GOOD, folder, write  # noqa: F401

from jffsr import cli
from jffsr.errors import InputError
from jffsr.study.config import load_config
from jffsr.study.sweep.arguments import split_values
from jffsr.study.sweep.points import expand
from jffsr.study.sweep.specification import is_sweep, read_sweep

SWEEPS = sorted((Path(__file__).parents[2] / "configs" / "sweeps").glob("*.yaml"))
SWEEP = """\
kind: sweep
base: base.yaml
"""


def points_of(text, *arguments):
    write("base.yaml", GOOD)
    return expand(read_sweep(write("sweep.yaml", SWEEP + text), arguments))


def values_of(text, *arguments):
    return [point.values for point in points_of(text, *arguments)]


@pytest.mark.parametrize("path", SWEEPS, ids=lambda path: path.stem)
def test_shipped_sweeps_expand(path):
    assert is_sweep(str(path))
    assert len(expand(read_sweep(str(path)))) > 1


def test_every_combination_in_order_the_seed_fastest():
    found = values_of("grid: {task.duration: [20, 25], optimizer.particles: [30, 40]}\nseeds: 2\n")
    expected = [
        {"task.duration": duration, "optimizer.particles": particles, "seed": seed}
        for duration in (20, 25)
        for particles in (30, 40)
        for seed in (0, 1)
    ]
    assert found == expected


def test_list_draws_and_grid_multiply():
    text = (
        "list: [{task.duration: 20, optimizer.kind: qpso}, {task.duration: 40}]\n"
        "random: {count: 3, keys: {optimizer.looseness: {log_uniform: [1, 100]}}}\n"
        "grid: {optimizer.starts: [1, 2]}\nseeds: [7, 9]\n"
    )
    points = points_of(text)
    assert len(points) == 2 * 3 * 2 * 2
    assert len({point.values["optimizer.looseness"] for point in points}) == 3
    assert {point.config.seed for point in points} == {7, 9}
    assert points[0].config.optimizer.kind == "qpso"
    assert points[-1].config.optimizer.kind == "hybrid"


def test_a_point_is_the_configuration_that_overrides_would_make():
    points = points_of(
        "set: {rollout.num_steps: 50}\ngrid: {task.goal_deg: [[45, 3], [10, 20]]}\nseeds: [4]\n"
    )
    overrides = ["rollout.num_steps=50", "task.goal_deg=[10,20]", "seed=4"]
    assert points[1].config == load_config("base.yaml", overrides)


def test_the_command_line_stands_in_for_the_files_values():
    text = "grid: {task.duration: [20, 25]}\nset: {optimizer.particles: 40}\nseeds: 3\n"
    points = points_of(text, "optimizer.particles=30,35", "task.duration=22", "seed=5,6")
    assert [point.config.seed for point in points] == [5, 6, 5, 6]
    assert {point.config.task.duration for point in points} == {22}
    assert "task.duration" not in points[0].values


def test_a_planning_configuration_is_swept_by_the_command_line_alone():
    name = write("plain.yaml", GOOD)
    points = expand(
        read_sweep(name, ["limits.base_excursion_deg=null,10", "task.goal_deg=[1,2],[3,4]", "seeds=2"])
    )
    assert len(points) == 8
    assert points[0].config.limits.base_excursion_deg is None
    assert points[-1].config.task.goal_deg == (3, 4)


def test_commas_in_brackets_and_quotes_divide_nothing():
    assert split_values("[1, 2],{a: [3,4], b: 5}, 'x, y' ,6") == ["[1, 2]", "{a: [3,4], b: 5}", "'x, y'", "6"]


def test_written_out_the_sweep_is_the_same():
    write("base.yaml", GOOD)
    text = (
        "grid: {task.duration: [20, 25.5]}\nrandom: {count: 2, seed: 3, keys: {seed: {integers: [0, 99]}}}\n"
    )
    spec = read_sweep(write("sweep.yaml", SWEEP + text))
    again = read_sweep(write("elsewhere/config.yaml", spec.to_yaml()))
    assert again.to_yaml() == spec.to_yaml()
    here, there = expand(spec), expand(again)
    assert [(p.values, p.config) for p in here] == [(p.values, p.config) for p in there]


def test_draws_follow_their_law_and_grow():
    def draw(count):
        laws = (
            "{task.duration: {uniform: [20, 40]}, optimizer.looseness: {log_uniform: [1, 100]}, "
            "optimizer.particles: {integers: [2, 5]}, optimizer.method: {choice: [lbfgs, adam]}}"
        )
        return values_of(
            f"random: {{count: {count}, seed: 1, keys: {laws}}}\nset: {{optimizer.starts: 1, rollout.num_steps: 9}}\n"
        )

    many = draw(300)
    assert draw(10) == many[:10]
    duration = np.array([values["task.duration"] for values in many])
    looseness = np.log10([values["optimizer.looseness"] for values in many])
    # Means of 300 uniform draws lie within four standard errors of the middle.
    assert abs(duration.mean() - 30) < 4 * 20 / np.sqrt(12 * 300)
    assert abs(looseness.mean() - 1) < 4 * 2 / np.sqrt(12 * 300)
    assert duration.min() >= 20
    assert duration.max() <= 40
    assert {values["optimizer.particles"] for values in many} == {2, 3, 4, 5}
    assert {values["optimizer.method"] for values in many} == {"lbfgs", "adam"}


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "there is nothing to sweep"),
        ("grid: {}\n", "sweep.yaml:3: grid: found an empty mapping"),
        ("grid: {task.duration: []}\n", "sweep.yaml:3: grid.task.duration: found an empty list"),
        ("grid: {task.duration: 20}\n", "grid.task.duration: found 20, a list of at least one"),
        ("grid:\n  optimizer.particle: [3]\n", "sweep.yaml:4: optimizer.particle: unknown key; did you mean"),
        ("grid:\n  optimizer.particles:\n  - 30\n  - 1\n", "sweep.yaml:6: optimizer.particles: found 1"),
        ("grid: {optimizer.kind: [qpso, pso2]}\n", "(point 1: optimizer.kind=pso2)"),
        ("grid: {'task duration': [1]}\n", "a dotted key such as optimizer.particles is expected"),
        ("grid: {name: [a, b]}\n", "'name' is the same at every point"),
        ("list: []\n", "list: found an empty list"),
        ("list: [{}]\n", "list.0: found an empty mapping"),
        ("seeds: 0\n", "sweep.yaml:3: seeds: found 0, a number of seeds from 1"),
        ("seeds: [1, 1]\n", "a seed is given twice"),
        ("seeds: [-1]\n", "a list of seeds in [0, 4294967295]"),
        ("seeds: 2\ngrid: {seed: [1]}\n", "'seed' is given in 'grid' and in 'seeds'"),
        ("seeds: 2\nset: {task.duration: 3}\nlist: [{task.duration: 4}]\n", "in 'set' and in 'list'"),
        ("grids: {}\n", "sweep.yaml:3: grids: unknown key; did you mean 'grid'?"),
        ("random: {count: 2}\n", "random.keys: missing"),
        ("random: {count: 0, keys: {}}\n", "random.count: found 0, a whole number in [1, 100000]"),
        ("random: {count: 1, keys: {task.duration: {normal: [0, 1]}}}\n", "{uniform: [...]}, {log_uniform:"),
        ("random: {count: 1, keys: {task.duration: {uniform: [3, 1]}}}\n", "[low, high] with low < high"),
        ("random: {count: 1, keys: {task.duration: {log_uniform: [0, 1]}}}\n", "with 0 < low < high"),
        ("random: {count: 1, keys: {seed: {integers: [0.5, 2]}}}\n", "two whole numbers are expected"),
        (
            "random: {count: 100000, keys: {task.duration: {uniform: [20, 30]}}}\nseeds: 100000\n",
            "at most 100000 are",
        ),
    ],
)
def test_refusals_name_the_place(text, told):
    with pytest.raises(InputError) as caught:
        points_of(text)
    assert told in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["task.duration"], "key=v1,v2 is expected"),
        (["task.duration=1,,2"], "a value is empty"),
        (["task.duration=20,30", "task.duration=5"], "'task.duration' is given twice"),
        (["task.duration=20,-1"], "override 'task.duration=-1': task.duration: found -1"),
        (["seeds=many"], "override 'seeds=many': found many, a number of seeds"),
        (["kind=planning,planning"], "'kind' is the same at every point"),
    ],
)
def test_the_command_refuses_with_one_sentence_and_no_folder(arguments, told, capsys):
    write("base.yaml", GOOD)
    assert cli.main(["sweep", "base.yaml", *arguments, "--out", "out"]) == cli.BAD_INPUT
    said = capsys.readouterr().err
    assert told in said
    assert said.count("\n") == 1
    assert not Path("out").exists()


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("kind: sweep\nseeds: 3\n", "base: missing or no text"),
        ("kind: sweep\nbase: nowhere\nseeds: 3\n", "'nowhere' is neither a file nor the name"),
        ("kind: sweep\nbase: base.yaml\nname: a/b\nseeds: 3\n", "sweep.yaml:3: name: a name of at most 100"),
    ],
)
def test_a_base_that_is_none(text, told):
    write("base.yaml", GOOD)
    with pytest.raises(InputError) as caught:
        read_sweep(write("sweep.yaml", text))
    assert told in str(caught.value)
