"""What docs/reference says of optimizers against the optimizers: options, and which kind uses which setting."""

from __future__ import annotations

import pytest
from configuration_keys import as_yaml
from reference_tables import plain, tables

from jffsr.optimizers.hyperparameters import OptionError, defaults, option_fields
from jffsr.optimizers.recipes import Hybrid
from jffsr.optimizers.registry import OPTIMIZERS, Settings, algorithm, build_phases, checked_options


def test_every_optimizer_has_its_options():
    page = tables("optimizer_options.md")
    assert set(page) == set(OPTIMIZERS) - {"cma_es"}
    for kind, rows in page.items():
        cls = algorithm(kind)
        known = cls.option_fields({}) if hasattr(cls, "option_fields") else option_fields(cls)
        # What a hybrid or memetic search takes beside its own stands under the swarm's and the descent's names.
        others = {**option_fields(algorithm("qpso")), **algorithm("gradient").option_fields({})}
        own = set(known) - set(others if kind in ("hybrid", "memetic") else {})
        assert {row[0] for row in rows} == own, kind
        for key, default, allowed, _ in rows:
            assert as_yaml(defaults(known)[key]) == default, (kind, key)
            with pytest.raises(OptionError) as refused:
                checked_options(kind, {key: ()})
            assert f", {allowed} is expected" in plain(refused.value.sentence), (kind, key)


def test_a_hybrid_takes_the_options_of_its_parts():
    taken = set(Hybrid.option_fields({"swarm": "de"}))
    page = tables("optimizer_options.md")
    assert taken == {row[0] for name in ("hybrid", "gradient", "de") for row in page[name]}


# Kinds that find something else where a setting is another, and the other value.
DESCENTS = {"hybrid", "gradient", "memetic"}
GENERATIONS = {"qpso", "pso", "ga", "ga_binary", "de", "ssade"}
USED = {
    "particles": (40, GENERATIONS | {"hybrid", "memetic"}),
    "evaluations": (3_000, GENERATIONS | {"memetic"}),
    "swarm_evaluations": (400, {"hybrid"}),
    "contraction": ((0.9, 0.4), {"qpso", "hybrid", "memetic"}),
    "starts": (3, DESCENTS),
    "gradient_iterations": (61, {"hybrid", "gradient"}),
    "polish_iterations": (31, {"hybrid", "gradient"}),
    "looseness": (9.0, DESCENTS),
    "method": ("adam", DESCENTS),
    "learning_rate": (0.1, DESCENTS),
    "memory": (9, DESCENTS),
    "target": (0.5, GENERATIONS | DESCENTS),
}


def test_every_setting_of_an_optimizer_is_looked_at():
    rows = {row[0] for row in tables("planning.md")["optimizer"]}
    assert set(USED) == rows - {"kind", "chunk", "options"}


@pytest.mark.parametrize("key", USED)
def test_a_setting_is_used_by_the_kinds_that_its_row_names(key):
    value, kinds = USED[key]
    found = {
        kind
        for kind in GENERATIONS | DESCENTS
        if repr(build_phases(kind, Settings())) != repr(build_phases(kind, Settings(**{key: value})))
    }
    assert found == kinds
    (meaning,) = (row[3] for row in tables("planning.md")["optimizer"] if row[0] == key)
    # Named are those that use it, or where those are most, the others.
    named = min(kinds, (GENERATIONS | DESCENTS) - kinds, key=len)
    assert {kind for kind in named if f"`{kind}`" not in meaning} == set()
