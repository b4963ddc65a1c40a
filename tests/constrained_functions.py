"""Published constrained problems with their known optima, and one whose multipliers are known in closed form.

g06, g08 and g11 are those of Michalewicz and Schoenauer (1996) as the CEC 2006 suite states them (Liang et al.);
hs71 is number 71 of Hock and Schittkowski (1981).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np


@dataclass(frozen=True)
class Published:
    """A problem with its optimum (d,) and the value there, as printed."""

    function: Callable
    lower: np.ndarray
    upper: np.ndarray
    optimum: np.ndarray
    value: float
    equality: Callable | None = None
    inequality: Callable | None = None


G06 = Published(
    lambda x: (x[0] - 10) ** 3 + (x[1] - 20) ** 3,
    np.array([13.0, 0.0]),
    np.array([100.0, 100.0]),
    np.array([14.095, 0.8429607892154795]),
    -6961.813875580155,
    inequality=lambda x: jnp.array(
        [-((x[0] - 5) ** 2) - (x[1] - 5) ** 2 + 100, (x[0] - 6) ** 2 + (x[1] - 5) ** 2 - 82.81]
    ),
)
G08 = Published(
    lambda x: -(jnp.sin(2 * jnp.pi * x[0]) ** 3) * jnp.sin(2 * jnp.pi * x[1]) / (x[0] ** 3 * (x[0] + x[1])),
    np.array([1e-3, 1e-3]),
    np.array([10.0, 10.0]),
    np.array([1.2279713, 4.2453733]),
    -0.0958250414180359,
    inequality=lambda x: jnp.array([x[0] ** 2 - x[1] + 1, 1 - x[0] + (x[1] - 4) ** 2]),
)
G11 = Published(
    lambda x: x[0] ** 2 + (x[1] - 1) ** 2,
    np.array([-1.0, -1.0]),
    np.array([1.0, 1.0]),
    np.array([np.sqrt(0.5), 0.5]),
    0.75,
    equality=lambda x: jnp.array([x[1] - x[0] ** 2]),
)
HS71 = Published(
    lambda x: x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2],
    np.ones(4),
    np.full(4, 5.0),
    np.array([1.0, 4.742999637, 3.821149979, 1.379408293]),
    17.0140173,
    equality=lambda x: jnp.array([jnp.sum(x**2) - 40]),
    inequality=lambda x: jnp.array([25 - jnp.prod(x)]),
)
