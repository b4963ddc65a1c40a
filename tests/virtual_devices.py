"""Running a script of the tests with more than one virtual CPU device."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import jffsr

TESTS = Path(__file__).parent


def output_of(script: Path, devices: int) -> Any:
    """What the script prints, read as JSON."""
    flags = f"{os.environ.get('XLA_FLAGS', '')} --xla_force_host_platform_device_count={devices}"
    places = [str(Path(jffsr.__file__).parents[1]), str(TESTS), os.environ.get("PYTHONPATH", "")]
    run = subprocess.run(
        [sys.executable, script],
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
        env={**os.environ, "XLA_FLAGS": flags.strip(), "PYTHONPATH": os.pathsep.join(filter(None, places))},
    )
    assert run.returncode == 0, run.stderr
    return json.loads(run.stdout)
