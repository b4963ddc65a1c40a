"""Loading a file that may be damaged: within a time, and with the message of a refusal at hand."""

from __future__ import annotations

from pathlib import Path

from time_limit import within

import jffsr
from jffsr.errors import InputError

SECONDS = 5.0


def attempt(path: Path):
    """The robot and no message, or no robot and the message of the refusal; whatever else is raised passes."""
    try:
        with within(SECONDS):
            return jffsr.load_robot(path), ""
    except InputError as error:
        return None, str(error)
