"""Reading a study's configuration and writing it back."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from typing import Any

import yaml
from pydantic import ValidationError

from jffsr.errors import InputError
from jffsr.reading.complaints import complaint
from jffsr.reading.did_you_mean import hint, listed
from jffsr.reading.sources import Sources
from jffsr.study.capture.schema import CaptureConfig
from jffsr.study.chain.schema import ChainConfig
from jffsr.study.composition import compose
from jffsr.study.lookup import find_config
from jffsr.study.reactionless.schema import ReactionlessConfig
from jffsr.study.schema import PlanningConfig
from jffsr.study.tracking.schema import TrackingConfig

Study = PlanningConfig | TrackingConfig | CaptureConfig | ReactionlessConfig | ChainConfig
KINDS: dict[str, type[Study]] = {
    "planning": PlanningConfig,
    "tracking": TrackingConfig,
    "capture": CaptureConfig,
    "reactionless": ReactionlessConfig,
    "chain": ChainConfig,
}

_KINDS = listed(f"'{kind}'" for kind in KINDS)


def load_config(path_or_name: str | os.PathLike[str], overrides: Sequence[str] = ()) -> Study:
    """The configuration of a study, given as a path or a name under `configs/`, with `a.b=value` overrides.

    Raises InputError: one sentence with the file and line (or the override), the key, what was found, and
    what is expected.
    """
    path = find_config(path_or_name)
    return validated(*compose(path, overrides), path.stem)


def validated(values: dict[str, Any], sources: Sources, stem: str) -> Study:
    """The configuration of a composed mapping, named after the stem where it has no name; raises InputError."""
    if values.get("name") is None:
        values["name"] = name_from(stem)
    if values.get("kind") is None:
        raise InputError(f"{sources.where('kind')}: missing, {_KINDS} is expected")
    kind = values["kind"]
    if not isinstance(kind, str) or kind not in KINDS:
        near = hint(kind, KINDS) if isinstance(kind, str) else ""
        raise InputError(f"{sources.where('kind')}: found {kind!r}, {_KINDS} is expected{near}")
    model = KINDS[kind]
    try:
        config = model.model_validate(values)
    except ValidationError as error:
        raise complaint(error, model, sources) from None
    config._sources = sources
    return config


def name_from(stem: str) -> str:
    """A study's name out of that of its file."""
    return re.sub(r"[^A-Za-z0-9_.-]", "_", stem)[:100]


def dump_config(config: Study) -> str:
    """The resolved configuration as YAML, every default written out; load_config reads it as an equal one."""
    return dump_values(config.model_dump())


def dump_values(values: dict[str, Any]) -> str:
    """Plain values as YAML that is read as equal ones."""
    return yaml.dump(_plain(values), Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=110)


class _Dumper(yaml.SafeDumper):
    """Short lists on one line, no anchors, and text quoted that the reader would take for a number."""

    def ignore_aliases(self, data) -> bool:
        return True

    def represent_dict(self, data) -> yaml.Node:
        return self.represent_mapping("tag:yaml.org,2002:map", data, flow_style=False)

    def represent_list(self, data) -> yaml.Node:
        flat = not any(isinstance(item, dict) for item in data)
        return self.represent_sequence("tag:yaml.org,2002:seq", data, flow_style=flat)


_Dumper.add_representer(list, _Dumper.represent_list)
_Dumper.add_representer(dict, _Dumper.represent_dict)
_Dumper.add_implicit_resolver(
    "tag:yaml.org,2002:float", re.compile(r"[-+]?[0-9.]+[eE][-+]?[0-9]+\Z"), list("-+.0123456789")
)


def _plain(value):
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    return [_plain(item) for item in value] if isinstance(value, list | tuple) else value
