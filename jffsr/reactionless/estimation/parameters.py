"""The load's own mass, centre of mass and inertia, and the momentum, from the momentum balance.

They are constant where the regressed matrix changes with every posture, so that nothing need be forgotten until the
load itself changes. The balance is linear in the load's reduced moments (`reduced_moments`): information on them is
summed up exactly, and a step of Gauss and Newton per sample fits to it the ten numbers that only rigid bodies have
(`pseudo_inertia`) and L in I. Nothing is lost by having been linearised where the estimate once was, which makes
extended Kalman filters overconfident here. A detector on the innovation lets go of the past where the load has
become another.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.pytrees import register_dataclass
from jffsr.reactionless.estimation.balance import Balance, Load, load_blocks
from jffsr.reactionless.estimation.least_squares import INITIAL
from jffsr.reactionless.estimation.pseudo_inertia import (
    NUM_PARAMETERS,
    load_from_parameters,
    parameters_from_load,
)
from jffsr.reactionless.estimation.reduced_moments import moment_regressor, reduced_moments
from jffsr.types import Array, Matrix, Matrix3, Scalar, Vector, Vector3

_GUESS = Load(1.0, np.zeros(3), np.diag([0.2, 0.2, 0.2]))


@register_dataclass
@dataclass(frozen=True, eq=False)
class LoadEstimate:
    """numbers (13,): the ten of the load in E and L in I, N m s; centre (13,): those it is drawn to with the weight
    of the first covariance; smoothed (3, 14): regressor and value, low-passed; information (13, 13) and pull (13,):
    what they tell of [reduced moments; L]; damping (), of the fit; covariance (13, 13), of the numbers; innovation
    (3,), N m s, of the last sample used; surprise (), the running mean of its square over what it should be; waited
    (), samples since the past was let go; count (), samples used; openings (), how often it was."""

    numbers: Vector
    centre: Vector
    smoothed: Matrix
    information: Matrix
    pull: Vector
    damping: Scalar
    covariance: Matrix
    innovation: Vector3
    surprise: Scalar
    waited: Scalar
    count: Scalar
    openings: Scalar

    @property
    def load(self) -> Load:
        """The load in the tool frame E."""
        return load_from_parameters(self.numbers[:NUM_PARAMETERS])

    @property
    def angular_momentum(self) -> Vector3:
        """L (3,), N m s, about the system's centre of mass, in I."""
        return self.numbers[NUM_PARAMETERS:]


@register_dataclass
@dataclass(frozen=True)
class LoadParameters:
    """Estimates a load's parameters directly.

    guess: the load assumed first, in E; initial: the covariance starts as that times the unit matrix; base_rate_noise,
    rad/s, and joint_rate_noise, rad/s: the sensors' deviations, which set the weight of a sample; least_noise, N m
    s, is added to them. threshold: the past is let go where the mean over `memory` samples of the squared innovation
    exceeds so many times its expected value, but not within `patience` samples of the last time. largest_step: bound
    of one sample's change of any of the load's numbers. smoothing: share of a new sample in the low-passed ones,
    from which the information comes. A base that is held still shows little but noise, in the regressor as in the
    value, and least squares would explain it by a whole without inertia; the balance is linear, so that it holds for
    low-passed samples too. steps, static: of the fit at each sample.
    """

    guess: Load = field(default_factory=lambda: _GUESS)
    initial: Array | float = INITIAL
    base_rate_noise: Array | float = 1e-5
    joint_rate_noise: Array | float = 1e-4
    least_noise: Array | float = 1e-3
    threshold: Array | float = 4.0
    memory: Array | float = 20.0
    patience: Array | float = 100.0
    largest_step: Array | float = 0.3
    smoothing: Array | float = 0.05
    steps: int = field(default=2, metadata={"static": True})

    def begin(self, balance: Balance) -> LoadEstimate:
        """The guess, and no momentum."""
        numbers = jnp.concatenate([parameters_from_load(self.guess), jnp.zeros(3)])
        size, count = numbers.size, jnp.zeros((), dtype=jnp.int32)
        return LoadEstimate(
            numbers=numbers,
            centre=numbers,
            smoothed=jnp.zeros((3, size + 1)),
            information=jnp.zeros((size, size)),
            pull=jnp.zeros(size),
            damping=jnp.asarray(1e-3),
            covariance=self.initial * jnp.eye(size),
            innovation=jnp.zeros(3),
            surprise=jnp.ones(()),
            waited=count,
            count=count,
            openings=count,
        )

    def update(self, state: LoadEstimate, balance: Balance) -> LoadEstimate:
        """One sample more; one that is lost changes nothing."""

        def moments(numbers: Vector) -> Vector:
            load = load_from_parameters(numbers[:NUM_PARAMETERS])
            return jnp.concatenate([reduced_moments(load, balance.robot_mass), numbers[NUM_PARAMETERS:]])

        regressor, value = moment_regressor(balance), balance.own_momentum
        now, slope = moments(state.numbers), jax.jacfwd(moments)(state.numbers)
        noise = self._noise(state, balance)
        innovation = value - regressor @ now
        seen = regressor @ slope
        expected = seen @ state.covariance @ seen.T + noise
        squared = innovation @ jnp.linalg.solve(expected, innovation) / 3
        # An estimate that is still settling is surprised by itself.
        settled = state.waited >= self.patience
        surprise = jnp.where(settled, state.surprise + (squared - state.surprise) / self.memory, 1.0)
        reopened = surprise > self.threshold

        sample = jnp.concatenate([regressor, value[:, None]], axis=1)
        share = jnp.where(reopened | (state.count == 0), 1.0, self.smoothing)
        smoothed = state.smoothed + share * (sample - state.smoothed)
        # A low-passed sample is worth more and repeats its neighbours: together, what a plain one is worth.
        weighed = smoothed[:, :-1].T @ jnp.linalg.solve(noise, smoothed)
        information = jnp.where(reopened, 0.0, state.information) + weighed[:, :-1]
        pull = jnp.where(reopened, 0.0, state.pull) + weighed[:, -1]
        centre = jnp.where(reopened, state.numbers, state.centre)
        numbers, damping, curvature = self._fitted(moments, state, centre, information, pull)
        covariance = jnp.linalg.inv(0.5 * (curvature + curvature.T))
        found = LoadEstimate(
            numbers=numbers,
            damping=damping,
            centre=centre,
            smoothed=smoothed,
            information=information,
            pull=pull,
            covariance=0.5 * (covariance + covariance.T),
            innovation=innovation,
            surprise=jnp.where(reopened, 1.0, surprise),
            waited=jnp.where(reopened, 0, state.waited + 1),
            count=state.count + 1,
            openings=state.openings + reopened,
        )
        good = balance.usable & jnp.all(jnp.isfinite(found.numbers)) & jnp.all(jnp.isfinite(found.covariance))
        return jax.tree.map(lambda new, old: jnp.where(good, new, old), found, state)

    def _fitted(
        self,
        moments: Callable[[Vector], Vector],
        state: LoadEstimate,
        centre: Vector,
        information: Matrix,
        pull: Vector,
    ) -> tuple[Vector, Scalar, Matrix]:
        """Numbers (13,), damping and curvature (13, 13) after steps of Levenberg and Marquardt; none that is worse
        counts."""

        def cost(numbers: Vector) -> Scalar:
            x, away = moments(numbers), numbers - centre
            return 0.5 * x @ information @ x - pull @ x + 0.5 * away @ away / self.initial

        def step(carry, _):
            numbers, damping, _ = carry
            now, slope = moments(numbers), jax.jacfwd(moments)(numbers)
            curvature = slope.T @ information @ slope + jnp.eye(now.size) / self.initial
            downhill = slope.T @ (pull - information @ now) + (centre - numbers) / self.initial
            change = jnp.linalg.solve(curvature + damping * jnp.diag(jnp.diagonal(curvature)), downhill)
            largest = jnp.max(jnp.abs(change[:NUM_PARAMETERS]))
            tried = numbers + change * jnp.minimum(1.0, self.largest_step / jnp.maximum(largest, 1e-300))
            better = cost(tried) <= cost(numbers)
            damping = jnp.clip(jnp.where(better, damping / 3, damping * 4), 1e-9, 1e9)
            return (jnp.where(better, tried, numbers), damping, curvature), None

        start = state.numbers, state.damping, jnp.zeros_like(information)
        return jax.lax.scan(step, start, None, length=self.steps)[0]

    def blocks(self, state: LoadEstimate, balance: Balance) -> tuple[Matrix3, Matrix, Vector3]:
        """Those of the robot plus those of the estimated load."""
        locked, coupling = load_blocks(balance, state.load)
        momentum = balance.rotation.T @ state.angular_momentum
        return balance.locked + locked, balance.coupling + coupling, momentum

    def _noise(self, state: LoadEstimate, balance: Balance) -> Matrix3:
        """Covariance (3, 3) of a sample's noise: that of the sensors, through the blocks of the whole."""
        locked, coupling, _ = self.blocks(state, balance)
        own = self.base_rate_noise**2 * locked @ locked.T + self.joint_rate_noise**2 * coupling @ coupling.T
        return own + self.least_noise**2 * jnp.eye(3)
