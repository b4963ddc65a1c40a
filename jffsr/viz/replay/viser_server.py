"""A viser server that only this machine can reach."""

from __future__ import annotations

import contextlib
import io
import socket
from typing import Any

from jffsr.errors import InputError

_PORT = 8080


def start_server(port: int | None = None) -> Any:
    """A viser.ViserServer on 127.0.0.1, at this port or the first free one from 8080 on.

    Where the port is taken, the next free one serves. Raises InputError where viser is not installed, and for a port
    that there is none of or that this user may not have.
    """
    if port is not None:
        _check(port)
    try:
        import viser
    except ImportError as error:
        raise InputError(
            f"replays need viser, which is not installed ({error}): pip install 'jffsr[show]'"
        ) from None
    with _quiet():
        return viser.ViserServer(host="127.0.0.1", port=_PORT if port is None else port, verbose=False)


def _check(port: int) -> None:
    # The server itself would wait for ever.
    if not 1 <= port <= 65535:
        raise InputError(f"--port {port}: a port is a whole number from 1 to 65535")
    with socket.socket() as probe:
        try:
            probe.bind(("127.0.0.1", port))
        except PermissionError:
            raise InputError(f"--port {port}: this user may not serve there; take one from 1024 on") from None
        except OSError:
            pass  # taken


def stop_server(server: Any) -> None:
    """End it, without a word."""
    with _quiet():
        server.stop()


def _quiet():
    # It announces itself whatever `verbose` says.
    return contextlib.redirect_stdout(io.StringIO())
