"""CMA-ES and the other strategies of evosax behind the package's interface.

Lange, "evosax: JAX-based evolution strategies", arXiv 2212.04180, 2022; CMA-ES: Hansen, "The CMA evolution strategy:
a tutorial", arXiv 1604.00772, 2016. A strategy moves in all of R^n, in coordinates in which the box is the unit cube;
what leaves the cube is reflected back into it, so that inside nothing is bent.
"""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import cache
from importlib.util import find_spec
from typing import Any

import jax
import jax.numpy as jnp

from jffsr.errors import InputError
from jffsr.optimizers.hyperparameters import choice, number
from jffsr.optimizers.interface import OptimizationProblem, Population
from jffsr.optimizers.population import PopulationOptimizer, PopulationState, box_width
from jffsr.pytrees import register_dataclass
from jffsr.types import Array

# Those of evosax that were tried here on shifted functions; they compare values over generations (POPULATIONS), or
# within one, where ranks say as much and have no scale.
DISTRIBUTIONS = ("CMA_ES", "Sep_CMA_ES", "SNES", "CR_FM_NES", "MA_ES")
POPULATIONS = ("PSO", "DifferentialEvolution")


@register_dataclass
@dataclass(frozen=True)
class Evosax(PopulationOptimizer):
    """A strategy of evosax; `spread` is the standard deviation that it begins with, in box widths.

    A strategy with a mean begins at the best of a given population, else anywhere in the box. particles and strategy
    are static.
    """

    spread: Array | float = number(0.3, 0, 10, inside=True)
    particles: int = field(default=50, metadata={"static": True})
    strategy: str = choice("CMA_ES", *DISTRIBUTIONS, *POPULATIONS)

    @staticmethod
    def check(options: Mapping[str, Any]) -> None:
        """InputError where evosax is not installed."""
        if find_spec("evosax") is None:
            raise InputError("this optimizer needs the package evosax: pip install 'jffsr[evosax]'")

    def _strategy(self, dimensions: int) -> tuple[Any, Any]:
        """The strategy and its parameters."""
        strategy, params = _made(self.strategy, self.particles, dimensions, bool(jax.config.jax_enable_x64))
        return strategy, params.replace(std_init=self.spread) if hasattr(params, "std_init") else params

    def init(
        self, key: Array, problem: OptimizationProblem, population: Population | None = None
    ) -> PopulationState:
        """The strategy's own start, and its first candidates."""
        state = super().init(key, problem, population)
        lower, _, width = box_width(problem)
        inside = (state.position - lower) / jnp.where(width > 0, width, 1.0)
        strategy, params = self._strategy(inside.shape[1])
        begin, ask = jax.random.split(jax.random.fold_in(state.key, 2**31 - 1))
        if self.strategy in POPULATIONS:
            worst = jnp.full(self.particles, jnp.finfo(inside.dtype).max)
            return replace(state, own=_typed((inside, strategy.init(begin, inside, worst, params))))
        free, own = strategy.ask(ask, strategy.init(begin, inside[0], params), params)
        return replace(state, position=_reflected(problem, free), own=_typed((free, own)))

    def keep(self, state: PopulationState, value: Array) -> tuple[Array, Array, Any]:
        """The candidates themselves: what to keep is the strategy's affair."""
        return state.position, value, state.own

    def propose(
        self, problem: OptimizationProblem, key: Array, generation: Array, state: PopulationState
    ) -> tuple[Array, Any]:
        """Tell the strategy what was found, and ask it where to look."""
        free, own = state.own
        strategy, params = self._strategy(free.shape[1])
        tell, ask = jax.random.split(key)
        if self.strategy in POPULATIONS:
            fitness = jnp.minimum(state.kept_value, jnp.finfo(free.dtype).max)
            begun = strategy.init(tell, free, fitness, params)
            told, _ = strategy.tell(tell, free, fitness, own, params)
            # The first generation is the one that a strategy is begun with.
            told = jax.tree.map(lambda a, b: jnp.where(generation == 0, a, b), begun, told)
        else:
            places = (
                jnp.zeros(self.particles)
                .at[jnp.argsort(state.kept_value)]
                .set(jnp.arange(self.particles, dtype=free.dtype))
            )
            told, _ = strategy.tell(tell, free, places, own, params)
        following = strategy.ask(ask, told, params)
        return _reflected(problem, following[0]), _typed(following, state.own)


@cache
def _made(name: str, particles: int, dimensions: int, x64: bool) -> tuple[Any, Any]:
    import evosax.algorithms

    def make() -> tuple[Any, Any]:
        with jax.enable_x64(x64):
            cls = getattr(evosax.algorithms, name)
            strategy = cls(population_size=particles, solution=jnp.zeros(dimensions))
            return strategy, strategy.default_params

    # Outside of whatever is being traced, so that it can be kept, and of a mesh that a batch is spread over: both are
    # matters of the thread.
    with ThreadPoolExecutor(1) as outside:
        return outside.submit(make).result()


def _reflected(problem: OptimizationProblem, free: Array) -> Array:
    """Points of R^n in units of the box, mirrored into it at its bounds."""
    lower, upper, width = box_width(problem)
    folded = jnp.abs(jnp.mod(free + 1, 2) - 1)
    return jnp.clip(lower + width * folded, lower, upper)


def _typed(tree: Any, like: Any = None) -> Any:
    """Arrays, of the types of `like`: a loop's state may not change its types."""
    arrays = jax.tree.map(jnp.asarray, tree)
    return arrays if like is None else jax.tree.map(lambda x, y: x.astype(jnp.asarray(y).dtype), arrays, like)
