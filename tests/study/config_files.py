"""Small configuration files for tests that work in a folder of their own."""

from pathlib import Path

import pytest

from jffsr.study.config import load_config

GOOD = """\
kind: planning
robot: wu_6dof
task:
  start_deg: [0, 90]
  goal_deg: [45, 3]
  duration: 30
"""


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """Every test of a module that imports this works in a folder of its own."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def write(name, text):
    """Write a text, or bytes as they are, under `name`; its name."""
    Path(name).parent.mkdir(parents=True, exist_ok=True)
    Path(name).write_bytes(text if isinstance(text, bytes) else text.encode())
    return name


def load(text, *overrides):
    """The configuration of a text."""
    return load_config(write("x.yaml", text), overrides)
