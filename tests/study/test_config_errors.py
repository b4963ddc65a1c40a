"""Bad configurations: the one sentence for every kind of mistake, and hostile files."""

import os

import pytest
from config_files import GOOD, folder, load, write  # noqa: F401 (the fixture acts by being here)

from jffsr.errors import InputError
from jffsr.optimizers.registry import GENERATIONAL, OPTIMIZERS
from jffsr.reading.did_you_mean import listed
from jffsr.study.building import build_problem
from jffsr.study.config import load_config
from jffsr.study.run_folder import RunFolder


def message(text, *overrides):
    with pytest.raises(InputError) as caught:
        load(text, *overrides)
    sentence = str(caught.value)
    assert "\n" not in sentence
    assert len(sentence) < 600
    return sentence


# --- bad input: what is added to a good file, and the sentence ---

RATE = "a number > 0, a list with one per joint or {joint: number, ...} is expected"
SEED = "a whole number in [0, 4294967295] is expected"
KINDS = listed(f"'{kind}'" for kind in OPTIMIZERS)
SWARMS = listed(f"'{kind}'" for kind in GENERATIONAL)
TOP = (
    "kind, name, robot, limits, task, trajectory, objective, constraints, rollout, robust, optimizer, verification, "
    "output, seed, precision"
)

ADDED = {
    "optimizer:\n  particels: 4\n": "x.yaml:8: optimizer.particels: unknown key; did you mean 'particles'?",
    "duration: 4\n": "x.yaml:7: duration: unknown key; did you mean 'task.duration'?",
    "zzz: 4\n": f"x.yaml:7: zzz: unknown key; the keys here are {TOP}",
    "seed: -1\n": f"x.yaml:7: seed: found -1, {SEED}",
    "seed: 1.5\n": f"x.yaml:7: seed: found 1.5, {SEED}",
    "seed: true\n": f"x.yaml:7: seed: found true, {SEED}",
    "seed: '3'\n": f"x.yaml:7: seed: found '3', {SEED}",
    "seed:\n": f"x.yaml:7: seed: found nothing, {SEED}",
    "seed: 010\n": f"x.yaml:7: seed: found '010', {SEED}",
    "limits: {rate: no}\n": f"x.yaml:7: limits.rate: found no (which YAML reads as false), {RATE}",
    "limits: {rate: 12:30}\n": f"x.yaml:7: limits.rate: found '12:30', {RATE}",
    "limits: {rate: 2018-01-01}\n": f"x.yaml:7: limits.rate: found '2018-01-01', {RATE}",
    "limits: {rate: .nan}\n": f"x.yaml:7: limits.rate: found .nan, {RATE}",
    "limits: {rate: 1e999}\n": f"x.yaml:7: limits.rate: found 1e999, {RATE}",
    "limits:\n  rate:\n  - 0.1\n  - -2\n": "x.yaml:10: limits.rate.1: found -2, a number > 0 is expected",
    "limits: {rate: 1, rate_deg: 3}\n": "x.yaml:7: limits.rate: both 'rate_deg' and 'rate' are given, "
    "keep one (or set the other to null)",
    "limits: {position_deg: [-324, 324]}\n": "x.yaml:7: limits.position_deg.0: found -324, "
    "a pair [low, high] for each joint is expected (and 1 more)",
    "limits: {position: [[3, 1]]}\n": "x.yaml:7: limits.position.0: found [3, 1], "
    "a pair [low, high] with low < high is expected",
    "limits: {base_excursion: [1, 2]}\n": "x.yaml:7: limits.base_excursion: found [1, 2], "
    "a list of 3 numbers > 0 (one per axis) is expected",
    "rollout: 3\n": "x.yaml:7: rollout: found 3, a mapping of num_steps, base_mode, kernel is expected",
    "rollout: {num_steps: 3}\n": "x.yaml:7: rollout.num_steps: found 3, "
    "a whole number in [4, 100000] is expected",
    "rollout: {base_mode: fixd}\n": "x.yaml:7: rollout.base_mode: found 'fixd', "
    "'floating', 'attitude_held' or 'fixed' is expected; did you mean 'fixed'?",
    "  angular_momentum: [0, 0, 1]\nrollout: {base_mode: attitude_held}\n": "x.yaml:7: "
    "task.angular_momentum: found [0.0, 0.0, 1.0], rollout.base_mode 'attitude_held' does not keep it, leave it out",
    "  linear_momentum: [0, 2, 0]\nrollout: {base_mode: fixed}\n": "x.yaml:7: "
    "task.linear_momentum: found [0.0, 2.0, 0.0], rollout.base_mode 'fixed' does not keep it, leave it out",
    "optimizer: {kind: qspo}\n": f"x.yaml:7: optimizer.kind: found 'qspo', {KINDS} is expected; "
    "did you mean 'qpso'?",
    "optimizer:\n  kind: de\n  options:\n    strategi: rand\n": "x.yaml:10: optimizer.options.strategi: "
    "unknown option; did you mean 'strategy'?",
    "optimizer:\n  kind: de\n  options:\n    strategy: rnad\n": "x.yaml:10: optimizer.options.strategy: "
    "found 'rnad', 'rand', 'pbest' or 'current_to_best' is expected; did you mean 'rand'?",
    "optimizer: {kind: de, options: {factor: 3}}\n": "x.yaml:7: optimizer.options.factor: "
    "found 3, a number in (0, 2) is expected",
    "optimizer: {kind: de, options: {factor: yes}}\n": "x.yaml:7: optimizer.options.factor: "
    "found true, a number in (0, 2) is expected",
    "optimizer: {kind: de, options: [1]}\n": "x.yaml:7: optimizer.options: "
    "found [1], a mapping of options of the optimizer is expected",
    "optimizer: {kind: de, particles: 3}\n": "x.yaml:7: optimizer.particles: "
    "3 particles are fewer than the 4 that 'de' needs",
    "optimizer: {options: {swarm: bees}}\n": f"x.yaml:7: optimizer.options.swarm: found 'bees', {SWARMS} is expected",
    "optimizer: {kind: gradient, options: {swarm: de}}\n": "x.yaml:7: optimizer.options.swarm: "
    "unknown option; the options here are gradient_tolerance, value_tolerance",
    "optimizer: {kind: ga_binary, options: {bits: 1.5}}\n": "x.yaml:7: optimizer.options.bits: "
    "found 1.5, a whole number in [1, 30] is expected",
    "optimizer: {kind: ga, options: {elitism: 1}}\n": "x.yaml:7: optimizer.options.elitism: "
    "found 1, true or false is expected",
    "optimizer: {particles: 500}\n": "x.yaml:7: optimizer.swarm_evaluations: found 200, "
    "at least one for each of the 500 particles is expected",
    "optimizer: {kind: qpso, evaluations: 5}\n": "x.yaml:7: optimizer.evaluations: found 5, "
    "at least one for each of the 50 particles is expected",
    "optimizer: {contraction: [1, 2]}\n": "x.yaml:7: optimizer.contraction.1: found 2, "
    "a number in (0, 1.781) is expected",
    "optimizer: {target: -1}\n": "x.yaml:7: optimizer.target: found -1, a number >= 0 or null is expected",
    "objective: {goal_attitude: {enabled: true}}\n": "x.yaml:7: objective.goal_attitude.enabled: "
    "found true, but no 'task.goal_attitude' is given",
    "objective: {terms: [{call: foo}]}\n": "x.yaml:7: objective.terms.0.call: found 'foo', "
    "a dotted name such as my_package.my_term is expected",
    "objective: {terms: [{call: a.joint_rate}]}\n": "x.yaml:7: objective.terms.0: "
    "a second term is named 'joint_rate', give each its own 'name'",
    "objective: {attitude_change: {enabled: off}, joint_rate: {enabled: off}, "
    "joint_acceleration: {enabled: off}}\n": (
        "x.yaml:7: objective: no term counts (an excursion only under a limit), at least one is expected"
    ),
    "output: {figures: 1}\n": "x.yaml:7: output.figures: found 1, true or false is expected",
    "precision: float16\n": "x.yaml:7: precision: found 'float16', 'float64' or 'float32' is expected; "
    "did you mean 'float64'?",
    "name: a b\n": "x.yaml:7: name: found 'a b', "
    "a name of at most 100 letters, digits, '_', '.' and '-' is expected",
    "  start: [1, 2]\n": "x.yaml:7: task.start: both 'start_deg' and 'start' are given, "
    "keep one (or set the other to null)",
    "  base_quaternion: [1, 1, 0, 0]\n": "x.yaml:7: task.base_quaternion: found [1, 1, 0, 0], "
    "a quaternion (w, x, y, z) of norm 1 within 0.001, not 1.41421, is expected",
    "  linear_momentum: [1, 2]\n": "x.yaml:7: task.linear_momentum: found [1, 2], "
    "a list of 3 numbers is expected",
    # YAML itself
    "task: {}\n": "x.yaml:7: key 'task' is given twice (first at line 3)",
    "  duration: 3\n": "x.yaml:7: key 'task.duration' is given twice (first at line 6)",
    "<<: {a: 1}\n": "x.yaml:7: merge keys '<<' are not read, a 'defaults' list builds on another file",
    "3: 4\n": "x.yaml:7: found '3' as a key, a key is text",
    "[a]: 4\n": "x.yaml:7: found a list or mapping as a key, a key is text",
    '"a\\nb": 4\n': "x.yaml:7: found 'a\\nb' as a key, a key is at most 60 letters",
    "name: !!python/object/apply:os.system [x]\n": (
        "x.yaml:7: the tag '!!python/object/apply:os.system' is not allowed, only plain values are"
    ),
    "name: !!int fast\n": "x.yaml:7: found 'fast', which is no int",
    "name: ${oc.env:HOME}\n": (
        "x.yaml:7: found '${oc.env:HOME}', but '${...}' and '???' mean nothing here, write the value"
    ),
    "name: '???'\n": "x.yaml:7: found '???', but '${...}' and '???' mean nothing here, write the value",
    "\tseed: 1\n": "x.yaml:7: not valid YAML: found character '\\t' that cannot start any token "
    "(indent with spaces, not tabs)",
    "seed: [1\n": "x.yaml:8: not valid YAML: expected ',' or ']', but got '<stream end>'",
    "name: *nowhere\n": "x.yaml:7: not valid YAML: found undefined alias 'nowhere'",
    "name: \x01\n": "x.yaml:7: the character U+0001 is not allowed in YAML",
    "---\nseed: 1\n": "x.yaml:7: a second document begins here, one is expected",
    "seed: 1" + "0" * 400 + "\n": "x.yaml:7: found a number of 401 digits, at most 400 are read",
    # composition
    "defaults: 3\n": "x.yaml:7: defaults: found '3', a list of files is expected",
    "defaults: [3]\n": "x.yaml:7: defaults: found '3', the name of a file is expected",
    "defaults: [x]\n": "x.yaml:7: defaults: the files build on each other in a circle (x.yaml -> x.yaml)",
    "defaults: [nearbye]\n": "x.yaml:7: defaults: there is no file 'nearbye' next to x.yaml; "
    "did you mean 'nearby'?",
    "defaults: [nearby]\noutput: []\n": "x.yaml:8: output: found a list, where a mapping was given before",
}


@pytest.mark.parametrize(("added", "sentence"), ADDED.items(), ids=lambda text: text[:40])
def test_what_is_wrong_is_said_in_one_sentence(added, sentence):
    write("nearby.yaml", "output: {figures: false}\n")
    assert message(GOOD + added) == sentence


DURATION = "a number in (0, 1e6] s or {min: ..., max: ...} is expected"
REPLACED = {
    ("30", "fast"): f"x.yaml:6: task.duration: found 'fast', {DURATION}",
    ("30", "0"): f"x.yaml:6: task.duration: found 0, {DURATION}",
    ("30", "{min: 3}"): "x.yaml:6: task.duration.max: missing, this key is required",
    ("30", "{min: 3, max: 2}"): "x.yaml:6: task.duration: min is 3 and max is 2, min < max is expected",
    ("[45, 3]", "[45, x]"): "x.yaml:5: task.goal_deg.1: found 'x', a number is expected",
    (
        "[45, 3]",
        "3",
    ): "x.yaml:5: task.goal_deg: found 3, a list of 1 to 100 numbers (one per joint) is expected",
    ("goal_deg", "gaol_deg"): "x.yaml:5: task.gaol_deg: unknown key; did you mean 'goal_deg'?",
    (
        "  goal_deg: [45, 3]\n",
        "",
    ): "x.yaml:3: task.goal_deg: missing, 'goal_deg' (or 'goal', in rad or m) is required",
    ("robot:", "robt:"): "x.yaml:2: robt: unknown key; did you mean 'robot'? (and 1 more)",
    ("robot: wu_6dof", ""): "x.yaml:1: robot: missing, this key is required",
    (
        "kind: planning",
        "",
    ): "x.yaml:2: kind: missing, 'planning', 'tracking', 'capture', 'reactionless' or 'chain' is expected",
    (
        "planning",
        "planing",
    ): "x.yaml:1: kind: found 'planing', 'planning', 'tracking', 'capture', 'reactionless' or 'chain' is expected; did "
    "you mean 'planning'?",
    (GOOD, ""): "x.yaml: the file is empty, a mapping of keys is expected",
    (GOOD, "[1]\n"): "x.yaml:1: a mapping of keys is expected, such as 'kind: planning'",
}


@pytest.mark.parametrize(("replace", "sentence"), REPLACED.items(), ids=lambda text: str(text)[:40])
def test_a_wrong_value_is_told_with_its_line(replace, sentence):
    assert message(GOOD.replace(*replace)) == sentence


OVERRIDES = {
    "seed": "override 'seed': key=value is expected, the key dotted such as optimizer.particles",
    "=3": "override '=3': key=value is expected, the key dotted such as optimizer.particles",
    "seed=-1": f"override 'seed=-1': seed: found -1, {SEED}",
    "seed=": f"override 'seed=': seed: found nothing, {SEED}",
    "seed.x=3": f"override 'seed.x=3': seed: found a mapping, {SEED}",
    "optimizer.particels=3": "override 'optimizer.particels=3': optimizer.particels: unknown key; "
    "did you mean 'particles'?",
    "task.goal_deg.5=3": "override 'task.goal_deg.5=3': task.goal_deg.5: "
    "'task.goal_deg' is a list of 2, its entries count from 0",
    "task.goal_deg.0=x": "override 'task.goal_deg.0=x': task.goal_deg.0: found 'x', a number is expected",
    "task=[1]": "override 'task=[1]': task: found a list, where a mapping was given before",
    "defaults=[a]": "override 'defaults=[a]': 'defaults' is read from files only",
    "seed=[1,": "override 'seed=[1,': not valid YAML: expected the node content, but found '<stream end>'",
    "seed=${oc.env:HOME}": "override 'seed=${oc.env:HOME}': found '${oc.env:HOME}', "
    "but '${...}' and '???' mean nothing here, write the value",
    "task.duration.min=3": "override 'task.duration.min=3': task.duration.max: missing, this key is required",
}


@pytest.mark.parametrize(("override", "sentence"), OVERRIDES.items(), ids=lambda text: text[:40])
def test_a_wrong_override_is_told_by_itself(override, sentence):
    assert message(GOOD, override) == sentence


def test_the_first_error_in_the_file_comes_first_and_the_others_are_counted():
    text = GOOD.replace("30", "fast") + "seed: x\noptimizer: {particles: 1}\n"
    assert message(text, "precision=1") == f"x.yaml:6: task.duration: found 'fast', {DURATION} (and 3 more)"


def test_an_error_in_a_file_that_is_built_on_names_that_file():
    write("sub/base.yaml", GOOD + "seed: x\n")
    assert message("defaults: [sub/base]\n") == f"sub/base.yaml:7: seed: found 'x', {SEED}"


def test_circles_and_towers_of_files_are_refused():
    write("a.yaml", "defaults: [b]\n")
    write("b.yaml", "defaults: [a]\n")
    circle = "the files build on each other in a circle (a.yaml -> b.yaml -> a.yaml)"
    with pytest.raises(InputError) as caught:
        load_config("a.yaml")
    assert str(caught.value) == f"b.yaml:1: defaults: {circle}"
    for i in range(12):
        write(f"t{i}.yaml", f"defaults: [t{i + 1}]\n")
    with pytest.raises(
        InputError, match=r"t9\.yaml:1: defaults: files build on files more than 10 levels deep"
    ):
        load_config("t0.yaml")
    for i in range(8):
        write(f"w{i}.yaml", f"defaults: [w{i + 1}, w{i + 1}, w{i + 1}]\n")
    write("w8.yaml", "seed: 1\n")
    with pytest.raises(InputError, match="the study builds on more than 50 files"):
        load_config("w0.yaml")


def test_one_file_may_be_built_on_twice():
    write("base.yaml", GOOD)
    write("left.yaml", "defaults: [base]\nseed: 1\n")
    write("right.yaml", "defaults: [base]\nrollout: {num_steps: 8}\n")
    config = load("defaults: [left, right]\n")
    assert (config.seed, config.rollout.num_steps) == (1, 8)


# --- hostile files ---


def laughs(levels):
    lines = ["a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    lines += [f"a{i + 1}: &a{i + 1} [{', '.join([f'*a{i}'] * 9)}]" for i in range(levels)]
    return "\n".join(lines)


HOSTILE = {
    "deep lists": ("x: " + "[" * 100_000, "nested more than 30 levels deep"),
    "deep mappings": ("x: " + "{a: " * 100_000, "nested more than 30 levels deep"),
    "deep blocks": ("\n".join(" " * i + "a:" for i in range(500)), "nested more than 30 levels deep"),
    "laughs": (laughs(9), "more than 20000 values"),
    "itself": ("x: &a [*a]", "nested more than 30 levels deep"),
    "long list": ("x: [" + "1," * 60_000 + "]", "more than 20000 values"),
    "large": ("#" * 1_000_001, "the file is larger than 1,000,000 bytes, the most that is read"),
    "latin-1": (b"kind: \xe9\n", "the file is not UTF-8 text (byte 0xe9)"),
    "utf-16": (GOOD.encode("utf-16"), "the file is not UTF-8 text (byte 0xff)"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_files_end_in_one_sentence(name):
    text, end = HOSTILE[name]
    assert message(text).endswith(end)


def test_a_small_alias_is_fine_and_so_is_a_byte_order_mark():
    config = load(b"\xef\xbb\xbf" + GOOD.replace("[0, 90]", "&q [0, 90]").replace("[45, 3]", "*q").encode())
    assert config.task.start_si == config.task.goal_si


# --- finding a configuration ---


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        (
            "composite_wu5",
            "'composite_wu5' is neither a file nor the name of a configuration under configs/; "
            "did you mean 'composite_wu6', 'composite_wu6_tight' or 'composite_7dof'?",
        ),
        ("", "found '', a configuration's path or name under configs/ is expected"),
        ("a\0b", "found 'a\\x00b', a configuration's path or name under configs/ is expected"),
        (".", ".: this is a folder, a YAML file is expected"),
        (os.devnull, f"{os.devnull}: this is not a regular file, a YAML file is expected"),
    ],
)
def test_a_configuration_that_is_not_there(name, sentence):
    with pytest.raises(InputError) as caught:
        load_config(name)
    assert str(caught.value) == sentence


def test_a_name_longer_than_any_file_is_refused():
    with pytest.raises(InputError, match="is neither a file nor the name of a configuration"):
        load_config("a" * 300)


def test_a_misspelt_file_is_told_with_the_one_beside_it():
    write("studies/tender.yaml", GOOD)
    with pytest.raises(
        InputError, match=r"'studies/tendr\.yaml' is no file; did you mean 'studies/tender\.yaml'\?"
    ):
        load_config("studies/tendr.yaml")


def test_overrides_are_a_list_of_texts():
    write("x.yaml", GOOD)
    with pytest.raises(
        InputError, match="overrides are a list of 'key=value' texts, found one text 'seed=1'"
    ):
        load_config("x.yaml", "seed=1")
    with pytest.raises(InputError, match="found '3' as an override, a text 'key=value' is expected"):
        load_config("x.yaml", [3])


def test_a_robots_file_is_no_study():
    write("arm.xml", "<robot name='arm'/>\n")
    with pytest.raises(
        InputError, match=r"arm\.xml:1: .*a robot's file, and a study names it under the key 'robot'"
    ):
        load_config("arm.xml")


def test_a_run_that_is_not_there_is_told_with_the_nearest_name(tmp_path):
    (tmp_path / "tender").mkdir()
    with pytest.raises(InputError, match=r"tendr: there is no such folder; did you mean 'tender'\?"):
        RunFolder(tmp_path / "tendr").read_summary()


def test_a_value_that_is_cut_short_is_known():
    write("x.yaml", GOOD)
    with pytest.raises(InputError, match="did you mean 'polynomial'"):
        load_config("x.yaml", ["trajectory.kind=poly"])


@pytest.mark.parametrize(("key", "wrong"), [("start_deg", "[90, 30, 0]"), ("goal_deg", "[-60]")])
def test_the_end_whose_length_is_not_the_robots_is_named(key, wrong):
    ends = {"start_deg": "[90, 30]", "goal_deg": "[-60, 90]", key: wrong}
    task = "".join(f"  {name}: {value}\n" for name, value in ends.items())
    limits = "limits: {position_deg: 324}\n"
    config = load(f"kind: planning\nrobot: hu_2011_planar2\ntask:\n{task}  duration: 20\n{limits}")
    with pytest.raises(InputError) as caught:
        build_problem(config)
    count = wrong.count(",") + 1
    line = 4 + list(ends).index(key)
    assert str(caught.value) == (
        f"x.yaml:{line}: task.{key}: found a list of {count}, robot 'hu_2011_planar2' has 2 joints (joint1, joint2)"
    )
