"""Inertia ratios as five free numbers, all of which a rigid body can have.

The second moments of a body's mass, S = tr(J)/2 1 - J, are positive definite just where J meets the triangle
inequalities strictly. S = L L' with L lower triangular, log-diagonal (a, b, -a - b) and three numbers below: so any
five numbers are a body's (after Rucker and Wensing, "Smooth parameterization of rigid-body inertia", 2022), and an
estimate never leaves the physical region. A torque-free motion tells J up to a factor only; det S = 1 fixes it. Zeros
are a body of three equal moments. Unlike two ratios of principal moments and the axes' attitude, they are smooth also
where moments are equal and axes undefined.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.errors import InputError
from jffsr.robots.checks import check_rigid
from jffsr.robots.lumping import on_host, to_array
from jffsr.types import Array, Matrix3, Vector3

NUM_PARAMETERS = 5


def inertia_from_parameters(parameters: Array) -> Matrix3:
    """Inertia (..., 3, 3), in units that make det S = 1, of five numbers (..., 5)."""
    a, b, xy, xz, yz = jnp.moveaxis(parameters, -1, 0)
    zero = jnp.zeros_like(a)
    rows = [[jnp.exp(a), zero, zero], [xy, jnp.exp(b), zero], [xz, yz, jnp.exp(-a - b)]]
    factor = jnp.stack([jnp.stack(row, axis=-1) for row in rows], axis=-2)
    moments = factor @ jnp.swapaxes(factor, -1, -2)
    trace = jnp.trace(moments, axis1=-2, axis2=-1)[..., None, None]
    return trace * jnp.eye(3, dtype=moments.dtype) - moments


def parameters_from_inertia(inertia: Matrix3) -> Array:
    """The five numbers (..., 5) of an inertia (..., 3, 3) in any unit; not finite where it is no body's."""
    trace = jnp.trace(inertia, axis1=-2, axis2=-1)[..., None, None]
    factor = jnp.linalg.cholesky(trace / 2 * jnp.eye(3) - inertia)
    diagonal = jnp.diagonal(factor, axis1=-2, axis2=-1)
    scale = jnp.exp(jnp.mean(jnp.log(diagonal), axis=-1))
    below = jnp.stack([factor[..., 1, 0], factor[..., 2, 0], factor[..., 2, 1]], axis=-1)
    return jnp.concatenate([jnp.log(diagonal[..., :2] / scale[..., None]), below / scale[..., None]], axis=-1)


def checked_parameters(where: str, inertia: Array) -> Array:
    """The five numbers of an inertia (3, 3) or its diagonal (3,), checked on the host; traced numbers pass.

    Raises InputError for what no rigid body can have, and for a flat body, which an estimate cannot start from.
    """
    inertia = to_array(inertia)
    inertia = inertia[:, None] * np.eye(3) if inertia.shape == (3,) else inertia
    if inertia.shape != (3, 3):
        raise InputError(f"{where}: inertia has shape {inertia.shape}; (3,) or (3, 3) is expected")
    numbers = on_host(inertia)
    if numbers is None:
        return parameters_from_inertia(inertia)
    check_rigid(where, 1.0, np.zeros(3), numbers[0])
    moments = np.linalg.eigvalsh(numbers[0])
    if moments[0] + moments[1] < moments[2] * (1 + 1e-6):
        raise InputError(
            f"{where}: principal moments of inertia ({', '.join(f'{m:g}' for m in moments)}) are those of a flat body, "
            f"{moments[0]:g} + {moments[1]:g} = {moments[2]:g}; an estimate must start inside the triangle inequality"
        )
    # Numbers of the host stay such also where something else is being traced.
    with jax.ensure_compile_time_eval():
        return np.asarray(parameters_from_inertia(jnp.asarray(numbers[0])))


def inertia_ratios(parameters: Array) -> Vector3:
    """Principal moments (..., 3), ascending, as shares of the largest."""
    moments = jnp.linalg.eigvalsh(inertia_from_parameters(parameters))
    return moments / moments[..., -1:]
