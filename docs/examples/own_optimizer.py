"""An optimizer of one's own: evolution with a step that halves, known by name to everything that searches."""

import sys
from dataclasses import dataclass, field

import jax
import jax.numpy as jnp

import jffsr
from jffsr.optimizers.hyperparameters import number
from jffsr.optimizers.population import PopulationOptimizer, box_width
from jffsr.optimizers.registry import GENERATIONAL, OPTIMIZERS

jax.config.update("jax_enable_x64", True)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Shrinking(PopulationOptimizer):
    """Every candidate is the best so far and a normal step, whose length halves every `half_life` generations."""

    spread: float = number(0.3, 0, 1)  # of the box's width; an option that settings and YAML may set
    half_life: float = number(10.0, 1, 1e6)
    particles: int = field(default=50, metadata={"static": True})

    def propose(self, problem, key, generation, state):
        lower, upper, width = box_width(problem)
        length = self.spread * width * 2.0 ** (-generation / self.half_life)
        step = length * jax.random.normal(key, state.position.shape)
        return jnp.clip(state.progress.best_position + step, lower, upper), ()


GENERATIONAL["shrinking"] = OPTIMIZERS["shrinking"] = f"{__name__}:Shrinking"


def main(small: bool = False):
    def rosenbrock(x):
        return jnp.sum(100 * (x[1:] - x[:-1] ** 2) ** 2 + (1 - x[:-1]) ** 2)

    found = {}
    evaluations = 2_000 if small else 20_000
    for name in ("shrinking", "qpso"):
        found[name] = jffsr.minimize(rosenbrock, ([-2.0] * 4, [2.0] * 4), name, evaluations, key=1)
        print(f"{name:10} {found[name].best_value:.3g} after {found[name].evaluations} evaluations")
    return found


if __name__ == "__main__":
    main(small="--small" in sys.argv)
