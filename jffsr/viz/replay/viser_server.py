"""A viser server that only this machine can reach."""

from __future__ import annotations

import contextlib
import io
from typing import Any

from jffsr.errors import InputError

_PORT = 8080


def start_server(port: int | None = None) -> Any:
    """A viser.ViserServer on 127.0.0.1, at this port or the first free one from 8080 on.

    Raises InputError where viser is not installed.
    """
    try:
        import viser
    except ImportError as error:
        raise InputError(
            f"replays need viser, which is not installed ({error}): pip install 'jffsr[show]'"
        ) from None
    with _quiet():
        return viser.ViserServer(host="127.0.0.1", port=_PORT if port is None else port, verbose=False)


def stop_server(server: Any) -> None:
    """End it, without a word."""
    with _quiet():
        server.stop()


def _quiet():
    # It announces itself whatever `verbose` says.
    return contextlib.redirect_stdout(io.StringIO())
