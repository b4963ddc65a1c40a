"""What several tests of robot files share."""

from __future__ import annotations

import pytest
from robot_texts import cube_stl


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty working folder with the mesh that the MJCF file names."""
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes" / "box.stl").write_bytes(cube_stl())
    monkeypatch.chdir(tmp_path)
    return tmp_path
