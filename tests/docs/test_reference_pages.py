"""The tables of docs/reference against the models that read the files: every key once, its default, what is allowed."""

from __future__ import annotations

import re

import pytest
from configuration_keys import REQUIRED, as_yaml, entries
from pydantic import ValidationError
from reference_tables import FROM_FILE, REFERENCE, entries_of, places, plain, tables, tables_in, walked

from jffsr.errors import InputError
from jffsr.study.config import KINDS, load_config
from jffsr.study.reactionless.schema import Load
from jffsr.study.schema_start import Start
from jffsr.study.schema_task import Task
from jffsr.study.sweep.draws import LAWS, MOST_DRAWS
from jffsr.study.sweep.specification import KEYS, read_sweep
from jffsr.study.tracking.schema_tracker import Tuning

PLACES = sorted(places())


@pytest.mark.parametrize("place", PLACES, ids="#".join)
def test_every_key_has_one_row(place):
    assert sorted(row[0] for row in tables(place[0])[place[1]]) == sorted(entries_of(place))


@pytest.mark.parametrize("place", PLACES, ids="#".join)
def test_defaults_and_what_is_allowed_are_those_of_the_models(place):
    known = entries_of(place)
    for key, default, allowed, meaning in tables(place[0])[place[1]]:
        for entry in known[key]:
            told = f"{place}: {key}"
            assert plain(entry.allowed) == allowed, told
            if default == FROM_FILE:
                assert (key, entry.default) == ("name", REQUIRED)
            else:
                assert plain(entry.default) == default.replace('""', ""), told
            assert len(meaning) > 1


def test_no_table_stands_apart():
    for page in {page for page, _ in PLACES}:
        assert {anchor for there, anchor in PLACES if there == page} == set(tables(page))
    assert sum(len(tables(page)[anchor]) for page, anchor in PLACES) > 300


def test_a_row_that_is_missing_or_made_up_would_be_seen():
    page = (REFERENCE / "planning.md").read_text(encoding="utf-8")
    line = next(line for line in page.splitlines() if line.startswith("| `num_steps` |"))
    rows = {row[0] for row in tables_in(page.replace(line, line.replace("num_steps", "steps")))["rollout"]}
    keys = {key for key, _, _ in walked(KINDS["planning"].model_fields["rollout"].annotation, ("", ""), [])}
    assert keys - rows == {"num_steps"}
    assert rows - keys == {"steps"}


ASKED = [
    (Task, {"goal": [1.0], "duration": 1.0}, "start"),
    (Task, {"start": [1.0], "duration": 1.0}, "goal"),
    (Start, {}, "start"),
    (Tuning, {"parameters": {"damping": [0.1, 0.2]}}, "rate_limit"),
    (Load, {"mass": 1.0, "inertia": [1.0, 1.0, 1.0]}, "angular_velocity"),
]


@pytest.mark.parametrize(("model", "values", "quantity"), ASKED)
def test_a_quantity_in_two_units_is_required_where_the_models_say_so(model, values, quantity):
    with pytest.raises(ValidationError, match=f"missing, '{quantity}_deg'"):
        model.model_validate(values)
    pairs = {entry.key: entry.default for entry in entries(model)}
    assert pairs[f"{quantity}_deg, {quantity}"] == REQUIRED


def test_a_name_that_is_not_given_is_that_of_the_file(tmp_path):
    (tmp_path / "my_study.yaml").write_text(
        "kind: planning\nrobot: wu_6dof\ntask: {start: [0], goal: [1], duration: 9}\n", encoding="utf-8"
    )
    assert load_config(tmp_path / "my_study.yaml").name == "my_study"


def test_the_keys_of_a_sweep_are_all_there():
    found = tables("sweep.md")
    assert [row[0] for row in found[""]] == list(KEYS)
    assert [row[0] for row in found["random"]] == ["count", "seed", "keys"]
    text = (REFERENCE / "sweep.md").read_text(encoding="utf-8")
    assert re.findall(r"^\| `(\w+)` \|", text.partition("### What is drawn")[2], re.MULTILINE) == list(LAWS)


@pytest.mark.parametrize(
    ("anchor", "key", "part"),
    [
        ("", "name", "name: a/b"),
        ("", "seeds", f"seeds: {10**9}"),
        ("random", "count", f"random: {{count: {MOST_DRAWS + 1}}}"),
        ("random", "seed", "random: {count: 1, seed: -1}"),
    ],
)
def test_a_sweep_is_refused_in_the_words_of_its_page(anchor, key, part, tmp_path):
    (allowed,) = (row[2] for row in tables("sweep.md")[anchor] if row[0] == key)
    (tmp_path / "sweep.yaml").write_text(f"kind: sweep\nbase: composite_wu6\n{part}\n", encoding="utf-8")
    with pytest.raises(InputError) as refused:
        read_sweep(tmp_path / "sweep.yaml")
    assert allowed in plain(str(refused.value))


@pytest.mark.parametrize(
    ("place", "values", "keys"),
    [
        (("planning.md", "trajectory"), {"kind": "polynomial"}, ["degree", "box"]),
        (("planning.md", "trajectory"), {"kind": "bspline"}, ["degree", "control_points", "box"]),
        (("tracking.md", "path"), {"kind": "waypoints"}, ["blend_share", "metres_per_radian"]),
        (("tracking.md", "path"), {"kind": "spline"}, ["degree", "metres_per_radian"]),
        (("tracking.md", "path"), {"kind": "arc", "via": [1, 0, 0]}, ["attitude"]),
        (("tracking.md", "timing"), {"kind": "trapezoid", "duration": 1.0}, ["ramp_fraction"]),
        (("tracking.md", "timing"), {"kind": "fastest"}, ["margin"]),
    ],
)
def test_what_null_stands_for_is_what_the_kind_takes(place, values, keys):
    (model,) = places()[place]
    if place[1] == "path":
        poses = [{"position": [x, 0, 0], "quaternion": [1, 0, 0, 0]} for x in range(4)]
        values = {**values, "poses": poses[: 2 if values["kind"] == "arc" else 4]}
    section = model.model_validate(values)
    for key in keys:
        (meaning,) = (row[3] for row in tables(place[0])[place[1]] if row[0] == key)
        told = re.findall(r"`null` is (?:`(\w+)`|([\d.]*\d)|pi for `\w+` and (\d))", meaning)
        assert as_yaml(getattr(section, key)) in {part for found in told for part in found if part}, key
