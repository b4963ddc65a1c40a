"""diffrax, its constant steps, with the classical Runge-Kutta of order 4 as a Butcher tableau of its own solvers.

diffrax has no classical method built in; a tableau is the way it asks for one. The right-hand side is that of the
obvious JAX.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from experiments.benchmarks.cases import Case
from experiments.benchmarks.opponents import obvious_jax
from experiments.benchmarks.opponents.integrate import quaternion_rate


def final_attitude(case: Case):
    """A function of one candidate (2n,): the final base quaternion (4,)."""
    import diffrax

    class ClassicalRungeKutta(diffrax.AbstractERK):
        tableau = diffrax.ButcherTableau(
            c=np.array([0.5, 0.5, 1.0]),
            b_sol=np.array([1, 2, 2, 1]) / 6,
            b_error=np.zeros(4),
            a_lower=(np.array([0.5]), np.array([0.0, 0.5]), np.array([0.0, 0.0, 1.0])),
        )
        interpolation_cls = diffrax.ThirdOrderHermitePolynomialInterpolation.from_k

        def order(self, terms):
            return 4

    twist = obvious_jax.twist(case)
    duration = case.step * case.steps

    def of(free):
        trajectory = case.trajectory.with_free(free)

        def slope(time, quaternion, _):
            q, qd, _ = trajectory(time)
            return quaternion_rate(quaternion, twist(q, qd, quaternion)[3:])

        solution = diffrax.diffeqsolve(
            diffrax.ODETerm(slope), ClassicalRungeKutta(), t0=0.0, t1=duration, dt0=case.step,
            y0=jnp.zeros(4).at[0].set(1.0), stepsize_controller=diffrax.ConstantStepSize(),
            saveat=diffrax.SaveAt(t1=True), max_steps=case.steps + 1,
        )  # fmt: skip
        final = solution.ys[0]
        return final / jnp.linalg.norm(final)

    return of


def batched(function):
    """One vmap."""
    return jax.vmap(function)
