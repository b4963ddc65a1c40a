"""The end effectors of a file that names none: the ends of its tree."""

from __future__ import annotations

from collections.abc import Collection, Iterable

import numpy as np

from jffsr.robots.description import FIXED, EndEffectorDescription, JointDescription, LinkDescription


def leaf_end_effectors(
    links: Iterable[LinkDescription],
    joints: Iterable[JointDescription],
    order: Iterable[str],
    except_for: Collection[str] = (),
) -> tuple[EndEffectorDescription, ...]:
    """The massless leaf links on fixed joints, else the leaf links, in this order, named after the link."""
    by_name = {link.name: link for link in links}
    parents = {joint.parent for joint in joints}
    fixed = {joint.child for joint in joints if joint.type == FIXED}
    children = {joint.child for joint in joints}
    leaves = [name for name in order if name in children and name not in parents and name not in except_for]
    massless = [name for name in leaves if by_name[name].mass is None and name in fixed]
    return tuple(EndEffectorDescription(name, name, np.zeros(3), np.eye(3)) for name in massless or leaves)
