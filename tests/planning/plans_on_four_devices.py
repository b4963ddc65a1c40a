"""Run with four virtual CPU devices: the planar problems planned in chunks, the numbers as JSON."""

from __future__ import annotations

import json
import sys

import jax
import numpy as np
from planar_problems import plan_in_chunks, planar_problems

import jffsr
from jffsr.planning import many


def main() -> None:
    """Print the plans, and how many programs they took."""
    jax.config.update("jax_enable_x64", True)
    assert jffsr.use_all_cores() == jax.device_count() == 4
    plans = plan_in_chunks(planar_problems(jffsr.load_robot("hu_2011_planar2")), seed=3)
    numbers = [np.asarray(x).tolist() for x in (plans.free, plans.cost, plans.motion.base_quaternion)]
    json.dump({"numbers": numbers, "programs": many._plan_chunk._cache_size()}, sys.stdout)


if __name__ == "__main__":
    main()
