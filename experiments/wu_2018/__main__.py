"""Wu et al. 2018 remade and bettered: the tables and pictures of docs/benchmarks/wu_2018.md.

Run it from the root of the repository: `python -m experiments.wu_2018`. It ends with 0 when it has finished, whatever
agrees; what does not is in the table.
"""

from __future__ import annotations

import argparse
import pickle
import time
from pathlib import Path
from typing import Any

import jax
import numpy as np

from experiments.pages import fill
from experiments.wu_2018.case import DURATIONS, RATE_LIMIT_DEG, Case, follow, measure
from experiments.wu_2018.figures import draw_all
from experiments.wu_2018.freedoms import exact_way, freedoms, postures, time_needed
from experiments.wu_2018.front import front
from experiments.wu_2018.page import claims, tables
from experiments.wu_2018.published import damped_at_peak, published_runs, rate_limit, search


def main() -> None:
    """Measure, or take what was measured, then write the tables and draw the pictures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", default="docs/benchmarks/wu_2018.md")
    parser.add_argument("--kept", default="runs/wu_2018.pickle", help="where the measurements are kept")
    parser.add_argument("--redraw", action="store_true", help="from what is kept alone")
    arguments = parser.parse_args()
    page, kept = Path(arguments.out), Path(arguments.kept)
    jax.config.update("jax_enable_x64", True)
    if not arguments.redraw:
        kept.parent.mkdir(parents=True, exist_ok=True)
        kept.write_bytes(pickle.dumps(measured()))
    found = pickle.loads(kept.read_bytes())
    page.parent.mkdir(parents=True, exist_ok=True)
    fill(page, tables(found), "Tracking through a singularity")
    draw_all(page.with_suffix(""), found)
    for what, published, value, agrees in claims(found):
        print(f"{'agrees' if agrees else 'does not':9} {what}: published {published}, measured {value}")


def measured() -> dict[str, Any]:
    """All measurements, on the host."""
    started = time.perf_counter()

    def done(what: str) -> None:
        print(f"{time.perf_counter() - started:5.0f} s: {what}", flush=True)

    case = Case.load()
    runs = published_runs(case)
    done("methods")
    searches, equal, gained, exact = {}, {}, {}, exact_way(case)
    for duration in DURATIONS:
        tracked, reference = runs[duration, "zero", "adaptive"]
        limit = RATE_LIMIT_DEG if duration == DURATIONS[0] else rate_limit(tracked)
        searches[duration] = search(case, duration, limit)
        target = case.target(duration)
        equal[duration] = {}
        for name, measurement in (("printed", reference), ("searched", searches[duration]["measured"])):
            damped = damped_at_peak(case, duration, measurement.peak)
            equal[duration][f"adaptive, {name} pair"] = measurement
            equal[duration][f"damped, lambda {float(damped.damping):.4f}"] = measure(
                case, target, follow(case, target, damped)
            )
        done(f"search, {duration:g} s")
        gained[duration] = freedoms(case, duration, reference, every=duration == DURATIONS[0])
        done(f"freedoms, {duration:g} s")
    first = DURATIONS[0]
    rates = next(row for row in gained[first] if row.freedom == "rates")
    reference = runs[first, "zero", "adaptive"][1]
    curves = front(case, first, reference, rates)
    done("front")
    peaks = {duration: runs[duration, "zero", "adaptive"][1].peak for duration in DURATIONS}
    return {
        "robot": case.robot,
        "runs": runs,
        "searches": searches,
        "equal": equal,
        "postures": postures(case, first),
        "freedoms": gained,
        "front": curves,
        "peak": reference.peak,
        "pace": {
            "turn_4": float(np.rad2deg(np.abs(np.diff(exact[:, 3])).sum())),
            **{f"peak_{d:g}": peaks[d] for d in DURATIONS},
            **{f"needed_{d:g}": time_needed(exact, peaks[d]) for d in DURATIONS},
        },
    }


if __name__ == "__main__":
    main()
