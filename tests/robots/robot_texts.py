"""Robot files that several tests read, and the mesh that they name. Every number in them is made up."""

from __future__ import annotations

import struct
from pathlib import Path

CUBE = [(x, y, z) for x in (0.1, 0.3) for y in (-0.1, 0.4) for z in (0.0, 0.2)]
CUBE_FACES = [
    (0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
    (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3),
]  # fmt: skip


def cube_stl() -> bytes:
    """A box off the origin as binary STL, so that MuJoCo has something to re-centre."""
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *CUBE[i], *CUBE[j], *CUBE[k], 0) for i, j, k in CUBE_FACES)
    return bytes(80) + struct.pack("<I", len(CUBE_FACES)) + body


def cube_obj() -> str:
    """The same box as OBJ."""
    lines = [f"v {x} {y} {z}" for x, y, z in CUBE] + [f"f {i + 1} {j + 1} {k + 1}" for i, j, k in CUBE_FACES]
    return "\n".join(lines) + "\n"


DATA = Path(__file__).parent.parent / "data"
URDF = (DATA / "robots" / "satellite.urdf").read_text(encoding="utf-8")
MJCF = (DATA / "robots" / "two_armed.xml").read_text(encoding="utf-8")
