"""The tracking benchmark's tables, from the rows of its measurement."""

from __future__ import annotations

from experiments.benchmarks.tracking_case import DURATION

VERSIONS = ("jax", "jaxlib", "numpy", "pin")


def report(rows: list[dict]) -> str:
    """Machine, the thousand trackers, and what a step, its Jacobian and its decomposition cost."""
    machine = next(row for row in rows if row["kind"] == "machine")
    loads = ", ".join(f"{row['load']:.1f}" for row in rows if row["kind"] == "load")
    versions = ", ".join(f"{name} {machine['versions'].get(name)}" for name in VERSIONS)
    timed = [row for row in rows if row["kind"] == "measurement" and "median" in row]
    missing = [row for row in rows if row["kind"] == "measurement" and "missing" in row]
    lines = [
        f"Measured {machine['date']} on {machine['processor']} ({machine['vectors']}), {machine['cores']} cores; "
        f"Python {machine['python']}, {versions}, {machine['compiler']}. Load of the machine (one-minute average; what "
        f"is measured counts in it) before and after each process: {loads}.",
        "",
        "### Many trackers",
        "",
        "| cores | program | trackers | seconds | tracker-seconds a second | speed-up | compile, s | difference |",
        "|---|---|---|---|---|---|---|---|",
    ]
    alone = next((row for row in timed if row["program"] == "jffsr, one at a time"), None)
    for row in (row for row in timed if row["work"] == "trackers"):
        ratio = "" if alone is None else f"{_each(alone) / _each(row):.1f}"
        lines.append(
            f"| {row['threads']} | {_name(row)} | {row['done']} | {row['median']:.3g} | "
            f"{DURATION / _each(row):,.0f} | {ratio} | {row['compile']:.1f} | {row['difference']:.0e} |"
        )
    lines += [
        "",
        "### One step, its Jacobian, its decomposition",
        "",
        "| work | cores | program | states | microseconds each | over jffsr | compile, s | difference |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for row in (row for row in timed if row["work"] != "trackers"):
        ours = next(other for other in timed if other["program"] == "jffsr" and _place(other) == _place(row))
        lines.append(
            f"| {row['work']} | {row['threads']} | {_name(row)} | {row['done']} | {1e6 * _each(row):.3g} | "
            f"{_each(row) / _each(ours):.2f} | {row['compile']:.1f} | {row['difference']:.0e} |"
        )
    if missing:
        lines += ["", *(f"* {row['program']} ({row['work']}): {row['missing']}" for row in missing)]
    return "\n".join(lines)


def _each(row: dict) -> float:
    return row["median"] / row["done"]


def _place(row: dict) -> tuple:
    return row["work"], row["threads"]


def _name(row: dict) -> str:
    return "jffsr, one call" if row["program"] == "jffsr" else row["program"]
