"""Settings that an optimizer does not use: they are no mistake, but whoever gave them expects an effect."""

from __future__ import annotations

from dataclasses import fields, replace

from jffsr.errors import InputError
from jffsr.optimizers.registry import Settings, build_phases


def unused_settings(name: str, settings: Settings) -> tuple[str, ...]:
    """Names of the settings that are not at their defaults and without which the same search would be made."""
    usual, search = Settings(), repr(build_phases(name, settings))

    def makes_no_difference(key: str) -> bool:
        try:
            return repr(build_phases(name, replace(settings, **{key: getattr(usual, key)}))) == search
        except InputError:
            return False

    return tuple(key for key in changed_settings(settings) if makes_no_difference(key))


def changed_settings(settings: Settings) -> tuple[str, ...]:
    """Names of the settings that are not at their defaults, the options apart."""
    usual = Settings()
    return tuple(
        f.name
        for f in fields(Settings)
        if f.name != "options" and getattr(settings, f.name) != getattr(usual, f.name)
    )
