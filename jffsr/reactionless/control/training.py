"""Input weights of the extreme learning machine, found by search: PSO-ELM and SSADE-ELM.

Ye, Dong and Hong 2019, section 3.2 and Table 2. A candidate is one machine's input weights and biases in [-1, 1]; its
value is the root-mean-square tracking error of closed loops that it controls, which start with zero output weights. The
paper also asks that a winner's weights be smaller, which can stall the search: values alone decide here. Its constants
of the swarm are printed the wrong way round: an inertia of 2 diverges; 0.2 and pulls of 2 are meant.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.errors import InputError
from jffsr.optimizers.driver import Outcome, run
from jffsr.optimizers.registry import Settings, build_phases
from jffsr.pytrees import register_dataclass
from jffsr.reactionless.control.extreme_learning import HIDDEN, INPUTS, ExtremeLearning, machine_weights
from jffsr.reactionless.control.recorded import Recorded
from jffsr.reactionless.plant import closed_loop
from jffsr.reactionless.plant_settings import LoopSettings
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.types import Array, Scalar, Vector

MEMBERS = 30
SEARCHES = {
    "pso": {"rule": "constant", "inertia": 0.2, "cognitive": 2.0, "social": 2.0},
    "ssade": {"stage": 0.85},
}
"""The paper's searches and their constants."""


@register_dataclass
@dataclass(frozen=True)
class MachineTraining:
    """The problem that a search is given: plants, with what they start from and follow, and the controller to tune.

    robots, states, references and keys have a leading axis of training runs; the weights of `controller` are replaced
    by the candidate's, of `nodes` hidden nodes (static).
    """

    robots: Robot
    states: State
    references: Recorded
    keys: Array
    controller: ExtremeLearning
    settings: LoopSettings
    nodes: int = field(default=HIDDEN, metadata={"static": True})

    def bounds(self) -> tuple[Vector, Vector]:
        """[-1, 1] for each of the 6 nodes numbers."""
        ones = np.ones(self.nodes * (INPUTS + 1))
        return -ones, ones

    def value(self, candidate: Vector) -> Scalar:
        """Root-mean-square tracking error, rad or m, over all runs, samples and joints."""
        weights, bias = machine_weights(candidate)
        controller = replace(self.controller, weights=weights, bias=bias)

        def error(robot: Robot, state: State, reference: Recorded, key: Array) -> Array:
            return closed_loop(robot, state, reference, controller, self.settings, key).error

        errors = jax.vmap(error)(self.robots, self.states, self.references, self.keys)
        return jnp.sqrt(jnp.mean(errors**2))

    def smooth_and_value(self, candidate: Vector, looseness: Scalar | float = 1.0) -> tuple[Scalar, Scalar]:
        """The value twice: it is its own stand-in."""
        value = self.value(candidate)
        return value, value


def train_machine(
    problem: MachineTraining, search: str, evaluations: int, key: Array, chunk: int = 10
) -> Outcome:
    """The best weights that a search ("pso" or "ssade") with 30 members finds within so many evaluations.

    `best_position` (6 nodes,) is what `machine_weights` takes. Raises InputError for another search.
    """
    if search not in SEARCHES:
        raise InputError(f"search is {search!r}; allowed are {', '.join(SEARCHES)}")
    settings = Settings(particles=MEMBERS, evaluations=evaluations, options=SEARCHES[search])
    return run(build_phases(search, settings), problem, key, chunk=chunk)
