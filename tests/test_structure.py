"""The shape of the package: imports point up the list of folders, importing is light, files are short."""

from __future__ import annotations

import ast
import inspect
import subprocess
import sys
from pathlib import Path

import pytest

import jffsr

PACKAGE = Path(jffsr.__file__).parent
FILES = sorted(PACKAGE.rglob("*.py"))

# A folder or module may import from itself and from those above it.
ORDER = [
    "errors",
    "reading",
    "writing",
    "types",
    "pytrees",
    "compiling",
    "parallel",
    "spatial",
    "robots",
    "dynamics",
    "clearance",
    "trajectories",
    "rollouts",
    "crosscheck",
    "objectives",
    "optimizers",
    "planning",
    "tracking",
    "target",
    "capture",
    "reactionless",
    "study",
    "viz",
    "cli_arguments",
    "cli",
    "__main__",
]
LARGEST_FILE = 400
HEAVY = ("jax", "jaxlib", "matplotlib", "xarray", "mujoco")


def place(file: Path) -> str:
    """The folder of the package that a file belongs to, or the module at its root."""
    relative = file.relative_to(PACKAGE)
    return relative.parts[0] if len(relative.parts) > 1 else relative.stem


def imported_modules(file: Path, tree: ast.AST):
    """Line and full name of every import of the package in a file, also inside functions."""
    package = ("jffsr", *file.relative_to(PACKAGE).parts[:-1])
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield node.lineno, alias.name
        elif isinstance(node, ast.ImportFrom):
            start = package[: len(package) - node.level + 1] if node.level else ()
            module = ".".join([*start, *([node.module] if node.module else [])])
            for alias in node.names:
                # `from jffsr import viz` names a folder in what is imported, not in where from.
                yield node.lineno, f"{module}.{alias.name}" if module == "jffsr" else module


def wrong_imports(files: list[Path]) -> list[str]:
    found = []
    for file in files:
        own = place(file)
        if own == "__init__":
            continue
        for line, module in imported_modules(file, ast.parse(file.read_text(encoding="utf-8"))):
            parts = module.split(".")
            if parts[0] != "jffsr" or len(parts) == 1 or parts[1] not in ORDER:
                continue
            if ORDER.index(parts[1]) > ORDER.index(own):
                found.append(f"{file.relative_to(PACKAGE.parent)}:{line} imports {module}, below {own}")
    return found


def test_every_folder_is_in_the_list():
    unknown = {place(file) for file in FILES} - {"__init__", *ORDER}
    assert not unknown


def test_imports_point_up_the_list():
    wrong = wrong_imports(FILES)
    assert not wrong, "\n".join(wrong)


def test_the_import_check_sees_lazy_and_relative_imports(monkeypatch, tmp_path):
    folder = tmp_path / "spatial"
    folder.mkdir()
    (folder / "bad.py").write_text(
        "from jffsr.errors import InputError\n"
        "def f():\n    from jffsr.study import config\n"
        "def g():\n    from ..planning import plan\n"
        "def h():\n    from jffsr import viz\n"
    )
    monkeypatch.setattr(sys.modules[__name__], "PACKAGE", tmp_path)
    wrong = wrong_imports([folder / "bad.py"])
    assert [text.split(" ")[0].rsplit(":", 1)[1] for text in wrong] == ["3", "5", "7"]


def test_files_are_short():
    long = [
        f"{f.relative_to(PACKAGE)}" for f in FILES if len(f.read_text("utf-8").splitlines()) > LARGEST_FILE
    ]
    assert not long


@pytest.mark.parametrize("module", ["jffsr", "jffsr.study.config"])
def test_importing_is_light(module):
    code = f"import sys, {module}; print([name for name in {HEAVY!r} if name in sys.modules])"
    root = str(PACKAGE.parent)
    run = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, cwd=root, timeout=60
    )
    assert run.returncode == 0, run.stderr
    assert run.stdout.strip() == "[]"


def test_help_is_light():
    code = (
        "import sys\nfrom jffsr.cli import main\nsys.argv = ['jffsr', '--help']\n"
        "try:\n    main()\nexcept SystemExit as end:\n    assert not end.code\n"
        f"print([name for name in {HEAVY!r} if name in sys.modules])"
    )
    run = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=False,
        cwd=str(PACKAGE.parent),
        timeout=60,
    )
    assert run.returncode == 0, run.stderr
    assert run.stdout.strip().endswith("[]")


@pytest.mark.parametrize("name", [name for name in jffsr.__all__ if name != "__version__"])
def test_public_name_resolves_and_says_what_it_is(name):
    public = getattr(jffsr, name)
    assert (inspect.getdoc(public) or "").strip(), f"{name} has no docstring"
    # A dataclass without a docstring gets its signature for one.
    assert not inspect.getdoc(public).startswith(f"{name}(")


def test_dir_lists_the_public_names():
    assert set(jffsr.__all__) <= set(dir(jffsr))


def test_unknown_name_is_refused():
    with pytest.raises(AttributeError, match="no_such_name"):
        _ = jffsr.no_such_name
