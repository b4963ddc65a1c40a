"""A free rigid body to be captured: its inertia, the frame that a camera sees, the frames that a tool may grasp."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import jax.numpy as jnp
import numpy as np

from jffsr.errors import InputError
from jffsr.pytrees import register_dataclass
from jffsr.reading.did_you_mean import hint
from jffsr.robots.checks import check_rigid
from jffsr.robots.geometry import Geometry
from jffsr.robots.lumping import array_module, on_host, to_array
from jffsr.robots.rigid_body import RigidBody
from jffsr.spatial.rotation import quaternion_conjugate, quaternion_multiply, quaternion_to_matrix
from jffsr.target.target_state import unit_quaternion
from jffsr.types import Array, Quaternion, Vector3

Frame = tuple[Vector3, Quaternion]
"""Origin (3,), m, and unit quaternion (4,) of a frame, in the frame it is fixed to."""


@register_dataclass
@dataclass(frozen=True, eq=False)
class Target:
    """A rigid body in the frame T, whose origin is its centre of mass; all numbers are differentiable.

    mass (), kg; inertia (3, 3), kg m^2, about the centre of mass in the axes of T, of which the motion needs the
    ratios only; marker_position (3,), m, and marker_quaternion (4,), the frame whose pose a camera measures;
    grasp_position (g, 3), m, and grasp_quaternion (g, 4), the grasp frames, each in T. `grasp_names`, `name` and
    `geometry` are static. The numbers are taken as they are: `Target.create` checks them.
    """

    mass: Array
    inertia: Array
    marker_position: Array
    marker_quaternion: Array
    grasp_position: Array
    grasp_quaternion: Array
    grasp_names: tuple[str, ...] = field(default=(), metadata={"static": True})
    name: str = field(default="target", metadata={"static": True})
    geometry: Geometry = field(default_factory=Geometry, metadata={"static": True})

    @classmethod
    def create(
        cls,
        inertia: Array,
        mass: Array = 1.0,
        marker: Frame = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)),
        grasps: Mapping[str, Frame] | None = None,
        name: str = "target",
        geometry: Geometry | None = None,
    ) -> Target:
        """The checked target: inertia (3, 3) or its diagonal (3,), kg m^2 or any multiple; frames in T by name.

        Raises InputError for what no rigid body can be, a triangle inequality among it, and for a frame that is none;
        traced numbers have no value yet and pass.
        """
        mass, inertia = to_array(mass), to_array(inertia)
        if inertia.shape == (3,):
            inertia = inertia[:, None] * np.eye(3)
        for what, value, shape in (("mass", mass, ()), ("inertia", inertia, (3, 3))):
            if value.shape != shape:
                raise InputError(f"target '{name}': {what} has shape {value.shape}, {shape} is expected")
        numbers = on_host(mass, inertia)
        if numbers is not None:
            check_rigid(f"target '{name}'", numbers[0], np.zeros(3), numbers[1])
        marker_position, marker_quaternion = _frame(f"target '{name}': marker", marker)
        frames = [_frame(f"target '{name}': grasp '{key}'", frame) for key, frame in (grasps or {}).items()]
        xp = array_module(frames)
        return cls(
            mass,
            inertia,
            marker_position,
            marker_quaternion,
            xp.stack([p for p, _ in frames]) if frames else np.zeros((0, 3)),
            xp.stack([q for _, q in frames]) if frames else np.zeros((0, 4)),
            tuple(grasps or ()),
            name,
            geometry or Geometry(),
        )

    @classmethod
    def of_body(
        cls,
        body: RigidBody,
        marker: Frame = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)),
        grasps: Mapping[str, Frame] | None = None,
    ) -> Target:
        """The target that is this body, with its name and shapes; frames are given in the body's own frame."""
        com = to_array(body.com)

        def moved(frame: Frame) -> Frame:
            return to_array(frame[0]) - com, frame[1]

        moved_grasps = {key: moved(frame) for key, frame in (grasps or {}).items()}
        shapes = tuple(replace(s, position=s.position - np.asarray(com)) for s in body.geometry.shapes)
        return cls.create(body.inertia, body.mass, moved(marker), moved_grasps, body.name, Geometry(shapes))

    def grasp_index(self, grasp: str | None = None) -> int:
        """Number of a grasp frame by its name; None is the first. Raises InputError for a name that is none."""
        if grasp is None and self.grasp_names:
            return 0
        if grasp not in self.grasp_names:
            names = ", ".join(self.grasp_names) or "none"
            raise InputError(
                f"target '{self.name}': grasp '{grasp}' does not exist; there are: {names}"
                f"{hint(str(grasp), self.grasp_names)}"
            )
        return self.grasp_names.index(grasp)

    def grasp_in_marker(self, grasp: str | None = None) -> Frame:
        """A grasp frame in the marker's: origin (3,), m, and quaternion (4,); it needs no centre of mass."""
        index = self.grasp_index(grasp)
        back = quaternion_conjugate(jnp.asarray(self.marker_quaternion))
        away = jnp.asarray(self.grasp_position[index] - self.marker_position)
        return quaternion_to_matrix(back) @ away, quaternion_multiply(back, self.grasp_quaternion[index])


def _frame(where: str, frame: Frame) -> Frame:
    position, quaternion = to_array(frame[0]), to_array(frame[1])
    if position.shape != (3,) or quaternion.shape != (4,):
        raise InputError(
            f"{where}: shapes {position.shape} and {quaternion.shape}; (3,) and (4,) are expected"
        )
    numbers = on_host(position)
    if numbers is not None and not np.all(np.isfinite(numbers[0])):
        raise InputError(f"{where}: position {numbers[0].tolist()} is not finite")
    return position, unit_quaternion(where, quaternion)
