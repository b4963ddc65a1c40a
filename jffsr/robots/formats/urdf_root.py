"""Which link of a URDF is the base: the root, or what a massless root carries."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np

from jffsr.errors import InputError
from jffsr.reading.did_you_mean import hint
from jffsr.robots.description import FIXED, JointDescription, LinkDescription

FLOATING = "floating"

Links = list[LinkDescription]
Joints = list[JointDescription]


def settle_root(links: Links, joints: Joints, shown: str) -> tuple[Links, Joints, set[str]]:
    """Links with the base first, joints hanging from it, and the massless links that were skipped.

    A massless root leads over a fixed or floating joint to the one child that has mass; where several
    have, it stays, and they are lumped in its frame.
    """
    root = _root(links, joints, shown)
    skipped: set[str] = set()
    by_name = {link.name: link for link in links}
    while by_name[root].mass is None:
        below = [joint for joint in joints if joint.parent == root]
        heavy = [
            joint
            for joint in below
            if joint.type in (FIXED, FLOATING) and _mass_below(joint, joints, by_name)
        ]
        floating = [joint for joint in below if joint.type == FLOATING]
        if not heavy:
            hinge = next((joint.name for joint in below if joint.type != FIXED), None)
            moved = f" and joint '{hinge}' moves what hangs from it" if hinge else ""
            raise InputError(
                f"{shown}: root link '{root}' has no mass{moved}: the robot has no base body; "
                "give the root an inertial; jffsr.attach(..., arm_base='drop') then puts the arm on any other base"
            )
        if floating and len(below) > 1:
            raise InputError(
                f"{shown}: joint '{floating[0].name}': floating is supported only where nothing else hangs from "
                f"the massless root '{root}'"
            )
        if len(heavy) > 1:
            break
        step = heavy[0]
        if step.child in skipped:
            raise InputError(f"{shown}: joint '{step.name}' closes a loop; closed loops are not supported")
        skipped.add(root)
        joints = _hang_below(root, step, joints)
        if step.type == FLOATING:
            links = [link for link in links if link.name != root]
        root = step.child
    for joint in joints:
        if joint.type == FLOATING:
            raise InputError(
                f"{shown}: joint '{joint.name}': type 'floating' is not supported except below a massless root"
            )
    links = [by_name[root], *(link for link in links if link.name != root)]
    return links, joints, skipped


def _root(links: Links, joints: Joints, shown: str) -> str:
    counts = Counter(link.name for link in links)
    for name, count in counts.items():
        if count > 1:
            raise InputError(f"{shown}: two links are named '{name}'; names must differ")
    parents: dict[str, str] = {}
    for joint in joints:
        for role, name in (("parent", joint.parent), ("child", joint.child)):
            if name not in counts:
                raise InputError(
                    f"{shown}: joint '{joint.name}': {role} link '{name}' does not exist{hint(name, counts)}"
                )
        if joint.child in parents:
            raise InputError(
                f"{shown}: link '{joint.child}' has two parents (joints '{parents[joint.child]}' and "
                f"'{joint.name}'); closed loops are not supported"
            )
        parents[joint.child] = joint.name
    children = set(parents)
    roots = [link.name for link in links if link.name not in children]
    if not roots:
        raise InputError(
            f"{shown}: every link is some joint's child, so there is no root; closed loops are not supported"
        )
    if len(roots) > 1:
        raise InputError(
            f"{shown}: links '{roots[0]}' and '{roots[1]}' are both roots: no joint has them as its child; "
            "one root is expected"
        )
    return roots[0]


def _mass_below(joint: JointDescription, joints: Joints, by_name: dict[str, LinkDescription]) -> bool:
    """Whether a joint's child, or a link fixed to it, has mass."""
    waiting, seen = [joint.child], set()
    while waiting:
        name = waiting.pop()
        if name in seen:
            continue
        seen.add(name)
        if by_name[name].mass is not None:
            return True
        waiting += [j.child for j in joints if j.parent == name and j.type == FIXED]
    return False


def _hang_below(root: str, step: JointDescription, joints: Joints) -> Joints:
    """The joints with `step` turned round, so that the old root hangs from its child; floating just ends."""
    if step.type == FLOATING:
        return [joint for joint in joints if joint is not step]
    back = replace(
        step,
        parent=step.child,
        child=root,
        position=-step.rotation.T @ step.position + np.zeros(3),
        rotation=step.rotation.T,
    )
    return [back if joint is step else joint for joint in joints]
