"""The commands, configurations and names on all pages are ones that exist: parsed and validated, not run."""

from __future__ import annotations

import ast
import re
import shlex
from pathlib import Path

import pytest
import yaml
from documentation import NAMES, ROOT, Block, blocks_of, commands, inline_code

import jffsr
from jffsr.cli_arguments import parser
from jffsr.errors import InputError
from jffsr.robots.loading import load_robot
from jffsr.study.config import load_config
from jffsr.study.sweep.points import expand
from jffsr.study.sweep.specification import read_sweep

MAKEFILE = (ROOT / "Makefile").read_text(encoding="utf-8")
TARGETS = set(re.findall(r"^([a-z][a-z-]+):", MAKEFILE, re.MULTILINE))

# What is no command of ours, by its first word, and why.
OTHERS = {"dask": "dask's own scheduler and worker"}
# A usage line, not a command.
SYNOPSIS = ("README.md", 2)
# Files that a command or configuration names and no page makes.
FOREIGN = {"my_robot.yaml": "servicer_7dof"}
# Sections of a configuration, by page and number: the configuration that they change.
SECTIONS = {
    ("docs/how-to/plan_a_motion.md", 2): "composite_wu6",
    ("docs/how-to/keep_clear.md", 1): "composite_7dof",
    ("docs/how-to/choose_an_optimizer.md", 1): "composite_wu6",
    ("docs/how-to/capture_a_target.md", 2): "tumbling_box",
}
# Files of robots, by page and number.
ROBOTS = {("docs/how-to/plan_a_motion.md", 3), ("docs/how-to/compose_a_robot.md", 1)}
KINDS = {"", "sh", "console", "python", "yaml", "xml", "text"}

shell = blocks_of("", "sh", "console")
python = blocks_of("python")
settings = blocks_of("yaml")


def by_place(block: Block) -> str:
    return block.place


def test_every_block_says_what_it_is():
    every = blocks_of(*KINDS)
    assert len(every) == sum(
        len(re.findall(r"^ *```", (ROOT / name).read_text("utf-8"), re.MULTILINE)) / 2 for name in NAMES
    )
    assert (len(shell), len(python), len(settings)) > (25, 30, 15)


@pytest.fixture
def here(tmp_path, monkeypatch):
    """An empty folder with the files that pages ask to be saved."""
    monkeypatch.chdir(tmp_path)
    for block in blocks_of("xml", "yaml", "python"):
        if block.saved_as:
            (tmp_path / block.saved_as).write_text(block.text, encoding="utf-8")
    for name, robot in FOREIGN.items():
        data = ROOT / "jffsr" / "robots" / "data" / f"{robot}.yaml"
        (tmp_path / name).write_text(data.read_text(encoding="utf-8"), encoding="utf-8")
    return tmp_path


@pytest.mark.parametrize("block", shell, ids=by_place)
def test_commands_are_ones(block, here):
    if (block.page, block.number) == SYNOPSIS and not block.kind:
        assert all(words[0] == "jffsr" for words in commands(block))
        return
    for words in commands(block):
        check_command(words, here)


def check_command(words: list[str], folder: Path) -> None:
    """One command against the parser, the configurations, the Makefile or the module that it names."""
    program, rest = words[0], words[1:]
    if program == "jffsr":
        arguments = parser().parse_args(rest)
        if rest[0] == "run":
            load_config(arguments.config, arguments.overrides)
        elif rest[0] == "sweep":
            assert len(expand(read_sweep(arguments.config, arguments.overrides))) > 1
        elif rest[0] in ("robots", "map") and arguments.robot:
            load_robot(arguments.robot)
    elif program == "make":
        names = [word for word in rest if "=" not in word]
        assert set(names) <= TARGETS
        assert all(re.search(rf"\b{word.partition('=')[0]}\b", MAKEFILE) for word in rest if "=" in word)
    elif program == "python":
        assert rest[0] == "-m"
        check_module(rest[1], rest[2:])
    else:
        assert program in OTHERS


def check_module(module: str, options: list[str]) -> None:
    """The module of this repository is there and knows the options."""
    if module == "pip":
        return
    path = ROOT / module.replace(".", "/")
    file = path / "__main__.py" if path.is_dir() else path.with_suffix(".py")
    text = file.read_text(encoding="utf-8")
    assert "__main__" in text or file.name == "__main__.py"
    assert all(f'"{option}"' in text for option in options if option.startswith("--"))


@pytest.mark.parametrize("name", NAMES)
def test_commands_in_the_text_are_ones(name):
    for code in inline_code(name):
        words = shlex.split(code) if re.match(r"(make|python -m) [a-z]", code) else []
        if words[:1] == ["make"]:
            assert words[1] in TARGETS, code
        elif words:
            check_module(words[2], words[3:])


def beside_configs(text: str) -> str:
    """A configuration that builds on shipped ones, wherever a page supposes it to lie, with their full paths."""

    def full(found: re.Match) -> str:
        (path,) = (ROOT / "configs").glob(f"*/{Path(found[2]).stem}.yaml")
        return f"{found[1]}{path}"

    return re.sub(r"(defaults: \[|base: )([\w./]+)", full, text)


@pytest.mark.parametrize("block", settings, ids=by_place)
def test_configurations_are_ones(block, here, monkeypatch):
    if (block.page, block.number) in ROBOTS:
        (here / "robot.yaml").write_text(block.text, encoding="utf-8")
        assert load_robot(here / "robot.yaml").num_joints > 0
        return
    base = SECTIONS.get((block.page, block.number))
    text = beside_configs(block.text if base is None else f"defaults: [{base}]\n{block.text}")
    (here / "page.yaml").write_text(text, encoding="utf-8")
    if yaml.safe_load(text).get("kind") == "sweep":
        assert len(expand(read_sweep("page.yaml"))) > 1
    else:
        load_config("page.yaml")


def test_a_wrong_configuration_would_be_seen(here):
    (here / "page.yaml").write_text(beside_configs("defaults: [composite_wu6]\ntask: {durations: 3}\n"))
    with pytest.raises(InputError, match="did you mean"):
        load_config("page.yaml")


@pytest.mark.parametrize("block", python, ids=by_place)
def test_python_compiles_and_names_what_exists(block):
    tree = ast.parse(block.text)
    used = [
        node.attr
        for node in ast.walk(tree)
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "jffsr"
    ]
    assert set(used) <= set(jffsr.__all__)


@pytest.mark.parametrize("name", NAMES)
def test_names_in_the_text_exist(name):
    named = {found for code in inline_code(name) for found in re.findall(r"\bjffsr\.(\w+)", code)}
    modules = {path.stem for path in (ROOT / "jffsr").iterdir()}
    assert named - set(jffsr.__all__) <= modules
