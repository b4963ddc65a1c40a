"""MuJoCo's compiler on a prepared text: its model, or its complaint with file, line and body."""

from __future__ import annotations

import re
import warnings
from pathlib import Path
from typing import Any

from jffsr.errors import InputError
from jffsr.robots.formats.mjcf_assets import give_meshes
from jffsr.robots.formats.mjcf_text import Prepared


def compile_mjcf(prepared: Prepared, shown: str, folder: Path) -> tuple[Any, Any]:
    """Specification and compiled model, nothing fused or discarded; InputError where MuJoCo refuses."""
    import mujoco

    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        try:
            spec = mujoco.MjSpec.from_string(prepared.text)
            # Fusing would lose bodies, the base's inertia among them, and their names.
            spec.compiler.fusestatic = False
            spec.compiler.discardvisual = False
            spec.compiler.usethread = False
            _check_joints(spec, shown)
            prepared.notes += give_meshes(spec, shown, folder)
            model = spec.compile()
        except InputError:
            raise
        except (ValueError, TypeError, mujoco.FatalError) as error:
            raise InputError(_sentence(str(error), prepared, shown)) from None
    prepared.notes += [f"MuJoCo says: {' '.join(str(warning.message).split())}" for warning in said]
    return spec, model


def _sentence(message: str, prepared: Prepared, shown: str) -> str:
    """MuJoCo's words behind the file, line and body that they are about."""
    words = " ".join(message.split()).rstrip(". ")
    line = re.search(r",? ?line (\d+)$", words)
    place = prepared.blame(int(line.group(1)), shown) if line else shown
    words = re.sub(r"^(XML )?(Error: )+", "", words[: line.start()] if line else words)
    words = re.sub(r",? ?(Element name '.*?', id \d+|Object name = .*)$", "", words).strip()
    words = re.sub(r"^(.*?),? ?Element '(\w+)'$", r"<\2>: \1", words)
    if "mjMINVAL" in words:
        return (
            f"{place}: it moves and has no inertia, or a mass or moment that is not positive, nor has any body fixed "
            "to it; a mass and an inertia are needed"
        )
    return f"{place}: MuJoCo does not accept it: {words}"


def _check_joints(spec: Any, shown: str) -> None:
    import mujoco

    for joint in spec.joints:
        if joint.type == mujoco.mjtJoint.mjJNT_BALL:
            raise InputError(
                f"{shown}: body '{joint.parent.name}': joint '{joint.name}' is a ball joint; allowed are hinge and "
                "slide, and a free joint on the base"
            )
        low, high = joint.range
        stated = joint.limited != mujoco.mjtLimited.mjLIMITED_FALSE and (low, high) != (0, 0)
        # MuJoCo reads a reversed range as none at all.
        if stated and not low < high:
            raise InputError(
                f"{shown}: body '{joint.parent.name}': joint '{joint.name}': position limits [{low:g}, {high:g}]; "
                "the lower must be less than the upper"
            )
