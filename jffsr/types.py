"""Array aliases and the conventions that every function of the package follows.

| what | choice |
|---|---|
| units | SI: m, kg, s, rad, N, N m; files may say degrees only in a key that ends in ``_deg`` |
| frames | ``I`` inertial; ``B`` base, origin at the base centre of mass; ``L_i`` link i; ``E`` end effector |
| twist, momentum, wrench | [linear; angular] |
| base twist | inertial velocity of the base centre of mass and angular velocity, in ``I`` unless named ``_B`` |
| quaternion | (w, x, y, z), Hamilton product, unit, turns body vectors into the parent frame |
| attitude error | rotation vector of R_desired' R, or the vector part of the relative quaternion |
| batch axes | leading in the public API |
| floating point | float64 for planning; float32 is an option that is measured, never a silent default |
| base frame | root link with its fixed children lumped in: origin at its centre of mass, axes of the root link |
| joint order | the order of the robot's joints; fixed joints carry no coordinate |
| time grid | ``num_steps`` equal steps on [0, duration], ``num_steps + 1`` samples |

In shape comments n is the number of joints, b = n + 1 the number of bodies (body 0 is the base, body
i + 1 is moved by joint i), m the number of end effectors, N the number of steps.
"""

from __future__ import annotations

from jax import Array

Scalar = Array
"""A number, shape ()."""
Vector = Array
"""A vector; its shape is in the docstring that uses it."""
Vector3 = Array
"""Shape (3,)."""
Quaternion = Array
"""Shape (4,), (w, x, y, z)."""
Matrix3 = Array
"""Shape (3, 3)."""
Twist = Array
"""Shape (6,), [linear; angular]."""
Matrix = Array
"""A matrix; its shape is in the docstring that uses it."""

__all__ = ["Array", "Matrix", "Matrix3", "Quaternion", "Scalar", "Twist", "Vector", "Vector3"]
