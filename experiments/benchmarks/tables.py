"""The measurements as markdown tables."""

from __future__ import annotations

from experiments.benchmarks.cases import ROBOTS
from experiments.benchmarks.opponents import registry as r
from experiments.benchmarks.targets import targets

REFERENCE = {"robot": "servicer_7dof", "batch": 1024, "steps": 200, "precision": "float64"}
JOINTS = {robot: words for words, robot in ROBOTS.items()}


def report(rows: list[dict]) -> str:
    """Everything between the marks of the page."""
    parts = [
        _machine(rows),
        "\n".join(f"* **{opponent.name}**: {opponent.note}." for opponent in r.OPPONENTS.values()),
        "### Targets\n\nSeven joints, 200 steps, batch 1,024, float64, medians of one run, unless said otherwise.",
        _targets(rows),
        "### One rollout, one core\n\nSeven joints, 200 steps, batch 1,024, float64. "
        "Compiling is apart; of C++ it is g++'s time, 0 where the library was there from an earlier run.",
        _ranking(rows, r.ROLLOUT, 1),
        "### One rollout, all cores\n\nThe same batch.",
        _ranking(rows, r.ROLLOUT, _cores(rows)),
        "### One base twist\n\nA batch of 16,384 postures, seven joints, one core.",
        _ranking(rows, r.TWIST, 1, batch=16384, unit=1e9, unit_name="ns"),
        "### Gradients\n\nOf the squared vector part of the final quaternion in the 14 free numbers.",
        _ranking(rows, r.GRADIENT, 1),
        "### Planning\n\nThe index of `composite_7dof` (smooth and published), with its gradient, and a whole "
        "generation of the swarm; batch 1,024, 200 steps.",
        _planning(rows),
        "### One thing varied\n\nMicroseconds a rollout, one core; the rest as in the first table. "
        "A mark ≈ says that a smaller batch was run, because the whole would take too long.",
        "\n\n".join(filter(None, (_axis(rows, axis) for axis in ("batch", "steps", "robot", "precision")))),
        _ceiling(rows),
    ]
    # A section is left out with its heading where nothing of it was measured.
    kept = [
        part
        for part, following in zip(parts, [*parts[1:], "end"], strict=True)
        if part and (following or not part.startswith("###"))
    ]
    return "\n\n".join(kept)


def number(value: float) -> str:
    """Three digits, and no powers of ten where there are more."""
    return f"{value:,.0f}" if value >= 100 else f"{value:.3g}"


def _measured(rows, work, threads=1, **where) -> list[dict]:
    wanted = REFERENCE | where | {"work": work, "threads": threads}
    return [row for row in rows if all(row.get(key) == value for key, value in wanted.items())]


def _cores(rows) -> int:
    return max((row["threads"] for row in rows if row["kind"] == "device"), default=1)


def _machine(rows) -> str:
    machine = next(row for row in rows if row["kind"] == "machine")
    devices = [row for row in rows if row["kind"] == "device"]
    versions = ", ".join(f"{name} {number or 'absent'}" for name, number in machine["versions"].items())
    kinds = sorted({f"{row['platform']} ({row['device']})" for row in devices})
    return (
        f"Measured {machine['date']} on {machine['processor']} ({machine['vectors']}), {machine['cores']} cores, "
        f"{machine['memory_gib']:.0f} GiB; JAX device: {', '.join(kinds)}. {machine['system']}, Python "
        f"{machine['python']}, {versions}, {machine['compiler'] or 'no C++ compiler'}."
    )


def _targets(rows) -> str:
    lines = ["| ratio | measured | target | |", "|---|---|---|---|"]
    for target in targets(rows):
        value = "" if target.value is None else f"{target.value:.3g}"
        lines.append(f"| {target.name} | {value} | {target.relation} {target.bound:g} | {target.verdict} |")
    return "\n".join(lines)


def _ranking(rows, work, threads, batch=1024, unit=1e6, unit_name="us") -> str:
    found = _measured(rows, work, threads, batch=batch)
    timed = sorted((row for row in found if "median" in row), key=lambda row: row["median"] / row["done"])
    fast = next((row["median"] / row["done"] for row in timed if row["opponent"] == r.FAST), None)
    if fast is None:
        return ""
    lines = [
        f"| | {unit_name} each, median | best | a second | times jffsr's | compile, s | batch run | "
        "difference |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for row in timed:
        each, best = row["median"] / row["done"], row["best"] / row["done"]
        difference = f"{row['difference']:.1e}" if row["opponent"] != r.FAST else "0"
        lines.append(
            f"| {row['opponent']} | {number(unit * each)} | {number(unit * best)} | {1 / each:,.0f} | "
            f"{each / fast:.3g} | {row['compile']:.1f} | {row['done']:,} | {difference} |"
        )
    for row in found:
        if "missing" in row:
            lines.append(f"| {row['opponent']} | {row['missing']} | | | | | | |")
    return "\n".join(lines)


def _planning(rows) -> str:
    lines = [
        "| | cores | us a candidate, median | best | whole batch, ms | compile, s |",
        "|---|---|---|---|---|---|",
    ]
    for work in ("index", "index and gradient", "generation"):
        for threads in dict.fromkeys((1, _cores(rows))):
            for row in _measured(rows, work, threads):
                if "median" not in row:
                    continue
                each, best = 1e6 * row["median"] / row["done"], 1e6 * row["best"] / row["done"]
                lines.append(
                    f"| {work}, {row['opponent']} | {threads} | {number(each)} | {number(best)} | "
                    f"{number(each * row['batch'] / 1e3)} | {row['compile']:.1f} |"
                )
    return "\n".join(lines) if len(lines) > 2 else ""


def _axis(rows, axis) -> str:
    """One column a value of the axis, one row an opponent."""
    found = [
        row
        for row in rows
        if row.get("work") == r.ROLLOUT
        and row["threads"] == 1
        and "median" in row
        and (row["axis"] == axis or not row["axis"])
    ]
    if not any(row["axis"] for row in found):
        return ""
    values = sorted({row[axis] for row in found}, key=_order)
    names = [name for name in r.OPPONENTS if any(row["opponent"] == name and row["axis"] for row in found)]
    words = [JOINTS.get(value, f"{value:,}" if isinstance(value, int) else value) for value in values]
    lines = ["| " + " | ".join([f"by {axis}", *words]) + " |", "|---" * (len(values) + 1) + "|"]
    for name in names:
        cells = []
        for value in values:
            row = next((x for x in found if x["opponent"] == name and x[axis] == value), None)
            about = "≈ " if row and row["done"] < row["batch"] else ""
            cells.append("" if row is None else f"{about}{number(1e6 * row['median'] / row['done'])}")
        lines.append("| " + " | ".join([name, *cells]) + " |")
    return "\n".join(lines)


def _order(value):
    return list(ROBOTS.values()).index(value) if value in JOINTS else value


def _ceiling(rows) -> str:
    work = next((row["rollout"] for row in rows if row["kind"] == "operations"), None)
    peaks = {row["threads"]: row["operations_per_second"] for row in rows if row["kind"] == "peak"}
    if work is None or 1 not in peaks:
        return ""
    lines = [
        f"### Ceiling\n\nA rollout of 200 steps is {work / 1e6:.2f} million floating-point operations in the kernel, "
        "counted by running it with numbers that only count; a multiply-add is two. The peak is of multiply-adds in "
        "registers and nothing else.",
        "",
        "| cores | peak, Gflop/s | kernel, share of peak | jffsr, share of peak (kernel's operations) |",
        "|---|---|---|---|",
    ]
    for threads, peak in sorted(peaks.items()):
        shares = []
        for name in (r.KERNEL, r.FAST):
            row = next(
                (x for x in _measured(rows, r.ROLLOUT, threads) if x["opponent"] == name and "median" in x),
                None,
            )
            shares.append("" if row is None else f"{work * row['done'] / row['median'] / peak:.0%}")
        lines.append(f"| {threads} | {peak / 1e9:.3g} | {shares[0]} | {shares[1]} |")
    return "\n".join(lines)
