"""How often a whole chain ends with the target in hand and the base still, and what fails in the others.

Random captures (those of `experiments.captures`, from a seed of their own), each as a study of configs/chain: a camera
sees the box for 300 s with a marker somewhere on it and a rough guess of its inertia, and all the rest follows. Every
run keeps its folder, so that the same command goes on where it was stopped.

Run it from the root of the repository: `python -m experiments.chain`; `--part 0/2` and `--part 1/2` share the work;
`--seeds 16,23` runs the samples of these numbers alone, and writes no page.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import jax
import numpy as np

from experiments.captures.sampling import WINDOW, Sample, draw, first_feasible, read_seed
from experiments.chain.page import write_page
from jffsr.compiling.keeping import keep_programs
from jffsr.study.chain.running import run_chain
from jffsr.study.config import load_config

CONFIG = "configs/chain/tumbling_capture.yaml"
SEED = "chain"
MASS = 150.0, 300.0
"""kg, of the boxes."""
PRIOR_DEVIATION = 0.05
"""Of each moment of inertia that is believed before any pose, as a share of the true one."""


def overrides(sample: Sample, number: int) -> list[str]:
    """What is different in the study of a sample."""
    rng = np.random.default_rng([read_seed(SEED), number, 1])
    mass = rng.uniform(*MASS)
    # The sampler's moments are those of 300 kg.
    inertia = sample.inertia * mass / 300.0
    guess = _guess(inertia, rng)
    marker = rng.uniform(-1, 1, 3) * sample.half
    turn = rng.normal(size=4)
    values = {
        "target.mass": mass,
        "target.inertia": inertia,
        "target.position": sample.position,
        "target.quaternion": sample.quaternion,
        "target.angular_velocity": sample.rate,
        "target.shapes": [{"type": "box", "size": sample.half}],
        "target.marker": {"position": marker, "quaternion": turn / np.linalg.norm(turn)},
        "target.grasps.handle": {"position": sample.grasp_position, "quaternion": sample.grasp_quaternion},
        "observation.prior.inertia": guess,
        "observation.seed": number,
        "hold.seed": number,
        "approach.step": 0.004,
        "grasp_time.window": list(WINDOW),
        "planner.times": 4,
        "planner.starts": 12,
        "planner.postures": 6,
        "observation.duration": 300.0,
        "output.figures": "false",
        "output.progress": "false",
    }
    return [f"{key}={_text(value)}" for key, value in values.items()]


def _guess(inertia: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Moments near the true ones that a rigid body can have."""
    while True:
        guess = inertia * (1 + PRIOR_DEVIATION * rng.normal(size=3))
        if 2 * guess.max() < 0.999 * guess.sum():
            return guess


def _text(value) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {_text(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list | tuple | np.ndarray):
        return "[" + ", ".join(_text(item) for item in value) + "]"
    return repr(float(value)) if isinstance(value, float | np.floating) else str(value)


def _whole_numbers(text: str) -> list[int]:
    return [int(word) for word in text.split(",")]


def main() -> None:
    """Run what is missing, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=100, help="chains")
    parser.add_argument("--part", default="0/1", help="which share of them, such as 0/2")
    parser.add_argument("--seeds", type=_whole_numbers, help="these alone, such as 16,23; no page is written")
    parser.add_argument("--folder", default="runs/chain")
    parser.add_argument("--out", default="docs/benchmarks/chain.md")
    arguments = parser.parse_args()
    jax.config.update("jax_enable_x64", True)
    keep_programs()
    part, parts = (int(number) for number in arguments.part.split("/"))
    folder, summaries = Path(arguments.folder), {}
    numbers = arguments.seeds or first_feasible(read_seed(SEED), arguments.count)
    for number in numbers:
        path = folder / f"{number:04d}"
        if numbers.index(number) % parts != part:
            continue
        config = load_config(CONFIG, overrides(draw(read_seed(SEED), number), number))
        summary = run_chain(config, path).summary
        summaries[number] = summary
        print(number, summary["result"]["sentence"], flush=True)
    if parts == 1 and arguments.seeds is None:
        write_page(Path(arguments.out), summaries)


if __name__ == "__main__":
    main()
