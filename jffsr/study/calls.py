"""A user's own function, named in a configuration as module.function."""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Callable

from jffsr.errors import InputError


def called_function(call: str, where: str, of: str) -> Callable:
    """The function; InputError that begins with `where` if it cannot be imported, or is no function `of` those."""
    module, _, name = call.rpartition(".")
    # A console script does not search the folder it is called from, where a user's own module lies.
    folder = os.getcwd()
    added = folder not in sys.path
    if added:
        sys.path.insert(0, folder)
    try:
        function = getattr(importlib.import_module(module), name)
    except Exception as error:
        raise InputError(f"{where}: '{call}' cannot be imported ({type(error).__name__}: {error})") from None
    finally:
        if added:
            sys.path.remove(folder)
    if not callable(function):
        raise InputError(f"{where}: '{call}' is not callable; a function of {of} is expected")
    return function
