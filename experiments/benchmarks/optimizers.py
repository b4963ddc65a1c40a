"""A generation's own cost, against evosax and pygmo: the table of docs/benchmarks/optimizers.md.

One process on one core, the same cheap objective (Rosenbrock's) for all, float64. A sample is a run of many
generations divided by their number; everything is compiled before, and the opponents are timed in turn.
"""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

from experiments.benchmarks.machine import describe_machine
from experiments.benchmarks.opponents.program import Program, compiled
from experiments.benchmarks.timing import timed
from experiments.pages import fill
from jffsr.optimizers.interface import FunctionProblem
from jffsr.optimizers.registry import Settings, build_phases

OURS = {
    "QPSO": ("qpso", {}),
    "PSO": ("pso", {}),
    "PSO, shared draws": ("pso", {"shared_draws": True}),
    "DE rand/1": ("de", {}),
    "SSADE": ("ssade", {}),
    "GA, real": ("ga", {}),
    "GA, binary": ("ga_binary", {}),
    "CMA-ES": ("cma_es", {}),
}
# evosax's PSO draws one weight a particle and pull, pygmo's one for each number.
EVOSAX = {
    "PSO, shared draws": "PSO",
    "DE rand/1": "DifferentialEvolution",
    "GA, real": "SimpleGA",
    "CMA-ES": "CMA_ES",
}
PYGMO = {
    "PSO": lambda pg, n, even: pg.pso(gen=n, variant=5, neighb_type=1, max_vel=0.5, memory=False),
    "DE rand/1": lambda pg, n, even: pg.de(gen=n, F=0.5, CR=0.9, variant=7, ftol=0.0, xtol=0.0),
    "GA, real": lambda pg, n, even: pg.sga(
        gen=n,
        cr=0.9,
        eta_c=10.0,
        m=0.05,
        param_m=20.0,
        crossover="sbx" if even else "exponential",
        mutation="polynomial",
    ),
    "CMA-ES": lambda pg, n, even: pg.cmaes(gen=n, ftol=0.0, xtol=0.0, memory=False, force_bounds=True),
}
SIZES = ((256, 12), (256, 28), (4096, 12), (4096, 28))
SMALL, MANY = 25, 64


def main() -> None:
    """Measure, or take what was measured, then write the table into the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", default="docs/benchmarks/optimizers.md", help="the page; rows go beside it")
    parser.add_argument("--quick", action="store_true", help="fewer samples of fewer generations")
    parser.add_argument("--only", default="", help="part of an algorithm's name")
    parser.add_argument("--redraw", action="store_true", help="only write the table anew")
    arguments = parser.parse_args()
    # One core for all: pygmo's algorithms know of no more. Set before JAX makes its threads.
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    page = Path(arguments.out)
    rows_file = page.with_suffix(".jsonl")
    if not arguments.redraw:
        jax.config.update("jax_enable_x64", True)
        page.parent.mkdir(parents=True, exist_ok=True)
        with rows_file.open("w") as file:
            for row in measured(arguments.quick, arguments.only):
                file.write(json.dumps(row) + "\n")
                file.flush()
    rows = [json.loads(line) for line in rows_file.read_text().splitlines()]
    fill(page, table(rows), "Optimizer benchmark")


def measured(quick: bool, only: str = ""):
    """The machine, then a row for every algorithm, size and number of runs."""
    yield {"machine": describe_machine()}
    for members, dimensions, runs in [*((m, d, 1) for m, d in SIZES), (SMALL, 12, 1), (SMALL, 12, MANY)]:
        generations = max(2, (400_000 if quick else 4_000_000) // (members * dimensions * runs))
        for name in (name for name in OURS if only in name):
            programs = {"jffsr": ours(name, members, dimensions, generations, runs)}
            lengths = {"jffsr": generations}
            # Its differential evolution sorts the population once for each member, which takes seconds.
            few = name == "DE rand/1" and members > 1000
            if name in EVOSAX and find_spec("evosax") and not (few and quick):
                lengths["evosax"] = 2 if few else generations
                programs["evosax"] = evosax(EVOSAX[name], members, dimensions, lengths["evosax"], runs)
            if name in PYGMO and find_spec("pygmo"):
                lengths["pygmo"] = generations
                programs["pygmo"] = pygmo(PYGMO[name], members, dimensions, generations, runs)
            times = timed(programs, repetitions=3 if quick else 9)
            yield {
                "algorithm": name,
                "members": members,
                "dimensions": dimensions,
                "runs": runs,
                "compile_seconds": {who: program.compile_seconds for who, program in programs.items()},
                "microseconds": {who: 1e6 * time.median / lengths[who] for who, time in times.items()},
            }


def rosenbrock(x):
    """The objective, of one candidate (d,)."""
    return jnp.sum(100 * (x[1:] - x[:-1] ** 2) ** 2 + (1 - x[:-1]) ** 2)


def ours(name: str, members: int, dimensions: int, generations: int, runs: int) -> Program:
    """The package's own step in a loop."""
    kind, options = OURS[name]
    settings = Settings(particles=members, evaluations=members * generations, options=options)
    optimizer = build_phases(kind, settings)[0].optimizer
    problem = FunctionProblem(np.full(dimensions, -5.0), np.full(dimensions, 10.0), rosenbrock)

    def search(key):
        state = jax.lax.scan(
            lambda s, _: (optimizer.step(problem, s), None), optimizer.init(key, problem), length=generations
        )[0]
        return state.progress.best_value

    return in_one_call(search, runs)


def evosax(strategy: str, members: int, dimensions: int, generations: int, runs: int) -> Program:
    """A strategy of evosax in the same loop."""
    import evosax.algorithms

    method = getattr(evosax.algorithms, strategy)(population_size=members, solution=jnp.zeros(dimensions))
    params = method.default_params

    def search(key):
        first = jax.random.uniform(key, (members, dimensions), minval=-5.0, maxval=10.0)
        if hasattr(method, "get_mean"):
            state = method.init(key, first[0], params)
        else:
            state = method.init(key, first, jax.vmap(rosenbrock)(first), params)
        state = jax.tree.map(jnp.asarray, state)

        def step(state, key):
            ask, tell = jax.random.split(key)
            candidates, state = method.ask(ask, state, params)
            return method.tell(tell, candidates, jax.vmap(rosenbrock)(candidates), state, params)[0], None

        return jax.lax.scan(step, state, jax.random.split(key, generations))[0].best_fitness

    return in_one_call(search, runs)


def pygmo(make: Callable, members: int, dimensions: int, generations: int, runs: int) -> Program:
    """An algorithm of pygmo in C++ on its own Rosenbrock function, one run after another."""
    import pygmo as pg

    algorithm = pg.algorithm(make(pg, generations, members % 2 == 0))
    population = pg.population(pg.rosenbrock(dimensions), members, seed=1)

    def search():
        return [algorithm.evolve(population).champion_f[0] for _ in range(runs)]

    return Program(search, 0.0)


def in_one_call(search: Callable, runs: int) -> Program:
    """The search from one key, or at once from several."""
    keys = jax.random.split(jax.random.key(1), runs)
    return compiled(search, keys[0]) if runs == 1 else compiled(jax.vmap(search), keys)


def table(rows: list[dict]) -> str:
    """The times, and ours over the best other's."""
    machine, rows = rows[0]["machine"], rows[1:]
    lines = [
        f"{machine['processor']}, {machine['cores']} cores, Python {machine['python']}, "
        + ", ".join(f"{name} {machine['versions'].get(name)}" for name in ("jax", "evosax", "pygmo"))
        + ". Microseconds a generation; of 64 runs together, of all of them.",
        "",
        "| algorithm | members | numbers | runs | jffsr | evosax | pygmo | jffsr / best other |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        times = row["microseconds"]
        others = [time for who, time in times.items() if who != "jffsr"]
        ratio = f"{times['jffsr'] / min(others):.2f}" if others else ""
        cells = [f"{times[who]:.4g}" if who in times else "" for who in ("jffsr", "evosax", "pygmo")]
        lines.append(
            f"| {row['algorithm']} | {row['members']} | {row['dimensions']} | {row['runs']} | "
            + " | ".join([*cells, ratio])
            + " |"
        )
    return "\n".join(lines)


if __name__ == "__main__":
    main()
