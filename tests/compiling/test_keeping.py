"""Where programs are kept, when not, and how much of them."""

from __future__ import annotations

import os
from pathlib import Path

import jax
import pytest

from jffsr.compiling import keeping, store

SETTINGS = (
    "jax_compilation_cache_dir",
    "jax_persistent_cache_min_compile_time_secs",
    "jax_persistent_cache_min_entry_size_bytes",
    "jax_enable_compilation_cache",
)


@pytest.fixture(autouse=True)
def surroundings(monkeypatch, tmp_path):
    """No variable is set but the home, and what is changed comes back."""
    for name in ("JFFSR_CACHE_DIR", "JAX_COMPILATION_CACHE_DIR", "XDG_CACHE_HOME", "LOCALAPPDATA"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.setattr(store, "_folder", None)
    before = {name: getattr(jax.config, name) for name in SETTINGS}
    yield
    for name, value in before.items():
        jax.config.update(name, value)


@pytest.mark.parametrize(
    ("variables", "expected"),
    [
        ({}, "home/.cache/jffsr"),
        ({"XDG_CACHE_HOME": "xdg"}, "xdg/jffsr"),
        ({"JAX_COMPILATION_CACHE_DIR": "jax", "XDG_CACHE_HOME": "xdg"}, "jax"),
        ({"JFFSR_CACHE_DIR": "own", "JAX_COMPILATION_CACHE_DIR": "jax"}, "own"),
    ],
)
def test_the_folder(variables, expected, monkeypatch, tmp_path):
    monkeypatch.setattr(keeping.sys, "platform", "linux")
    for name, value in variables.items():
        monkeypatch.setenv(name, str(tmp_path / value))
    assert keeping.keep_programs() == tmp_path / expected
    assert store._folder == tmp_path / expected
    assert jax.config.jax_compilation_cache_dir == str(tmp_path / expected)
    assert (tmp_path / expected).is_dir()
    # Small programs are kept too.
    assert jax.config.jax_persistent_cache_min_compile_time_secs == 0


def test_off(monkeypatch, tmp_path):
    monkeypatch.setenv("JFFSR_CACHE_DIR", "off")
    assert keeping.keep_programs() is None
    assert (store._folder, jax.config.jax_compilation_cache_dir) == (None, None)
    monkeypatch.delenv("JFFSR_CACHE_DIR")
    jax.config.update("jax_enable_compilation_cache", False)
    assert keeping.keep_programs() is None
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_cannot_be_written_is_told_and_does_without(monkeypatch, tmp_path, capsys):
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("JFFSR_CACHE_DIR", str(tmp_path / "file" / "cache"))
    assert keeping.keep_programs() is None
    assert jax.config.jax_compilation_cache_dir is None
    said = capsys.readouterr().err
    assert said.startswith("jffsr: compiled programs are not kept: ")
    assert said.count("\n") == 1


def test_no_home_means_no_folder(monkeypatch):
    def homeless():
        raise RuntimeError("no home")

    monkeypatch.setattr(Path, "home", homeless)
    assert keeping.keep_programs() is None


def test_what_was_not_used_for_longest_goes_first(tmp_path):
    for day, name in enumerate("abcd"):
        (tmp_path / name).write_bytes(b"x" * 100)
        os.utime(tmp_path / name, (day, day))
    (tmp_path / "folder").mkdir()
    os.utime(tmp_path / "a", (9, 0))  # read since
    keeping.shorten(tmp_path, 400)
    assert len(list(tmp_path.iterdir())) == 5
    keeping.shorten(tmp_path, 250)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a", "d", "folder"]
    keeping.shorten(tmp_path, 0)
    assert [path.name for path in tmp_path.iterdir()] == ["folder"]
