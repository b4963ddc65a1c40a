"""A target as an estimate has it: what a planner takes for the truth."""

from __future__ import annotations

from dataclasses import replace

import jax.numpy as jnp
import numpy as np

from jffsr.robots.geometry import Geometry
from jffsr.spatial.rotation import quaternion_to_matrix
from jffsr.target.body import Target
from jffsr.target.estimate import TargetEstimate
from jffsr.target.inertia_parameters import inertia_from_parameters

_UNIT = np.array([1.0, 0.0, 0.0, 0.0])


def estimated_target(target: Target, estimate: TargetEstimate) -> Target:
    """The target whose T has its origin in the estimated centre of mass and the axes of the marker, on the host.

    What is known of the true one is taken over: name, mass, and where grasp frames and shapes are in the marker's.
    Inertia and centre of mass are the estimate's.
    """
    offset = np.asarray(estimate.marker_offset_T)
    frames = {name: target.grasp_in_marker(name) for name in target.grasp_names}
    return Target.create(
        np.asarray(inertia_from_parameters(estimate.inertia_parameters)),
        target.mass,
        (offset, _UNIT),
        {name: (offset + np.asarray(p), np.asarray(q)) for name, (p, q) in frames.items()},
        target.name,
        estimated_geometry(target, target.geometry, estimate),
    )


def estimated_geometry(target: Target, geometry: Geometry, estimate: TargetEstimate) -> Geometry:
    """Shapes given in the T of the true target, in that of the estimated one."""
    back = np.asarray(quaternion_to_matrix(jnp.asarray(target.marker_quaternion))).T
    offset = np.asarray(estimate.marker_offset_T)
    return Geometry(
        tuple(
            replace(
                shape,
                position=back @ (shape.position - np.asarray(target.marker_position)) + offset,
                rotation=back @ shape.rotation,
            )
            for shape in geometry.shapes
        )
    )
