"""The tables of the page: what is published, what is measured, and whether they agree."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from experiments.wu_2018.case import DURATIONS, EPSILON, LAMBDA_MAX, RATE_LIMIT_DEG, Measured
from experiments.wu_2018.published import zero_of_determinant


def tables(found: Mapping[str, Any]) -> str:
    """All that the page says of the measurements."""
    parts = [
        _claims(found),
        _runs(found["runs"]),
        _searches(found["searches"]),
        _equal(found["equal"]),
        _postures(found["postures"]),
        *(_freedoms(duration, rows) for duration, rows in found["freedoms"].items()),
        _pace(found["pace"]),
        _tenth(found["freedoms"]),
    ]
    return "\n\n".join(parts)


def _table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = ["| " + " | ".join(heads) + " |", "|---" * len(heads) + "|"]
    return "\n".join([*lines, *("| " + " | ".join(row) + " |" for row in rows)])


def claims(found: Mapping[str, Any]) -> list[tuple[str, str, str, bool]]:
    """What the paper says, the published and the measured figure, and whether the measured one agrees."""
    runs, searches = found["runs"], found["searches"]
    rows = []
    for duration in DURATIONS:
        tracked, adaptive = runs[duration, "zero", "adaptive"]
        _, damped = runs[duration, "zero", "damped"]
        _, inverse = runs[duration, "zero", "inverse"]
        zero = zero_of_determinant(tracked)
        fall = 100 * (1 - adaptive.index / damped.index)
        searched = searches[duration]
        pair = (searched["lambda_max"], searched["epsilon"])
        near = all(abs(a / b - 1) < 0.1 for a, b in zip(pair, (LAMBDA_MAX, EPSILON), strict=True))
        what = f"{duration:g} s: "
        rows += [
            (what + "det(GJM) near zero at", "7.5 s", f"{zero:.2f} s", 7.2 < zero < 8.0),
            (
                what + "the inverse's rates become very large",
                "yes",
                f"{inverse.peak:,.0f} deg/s",
                inverse.peak > 10 * RATE_LIMIT_DEG,
            ),
            (
                what + "largest rate, printed pair",
                "at most 6 deg/s",
                f"{adaptive.peak:.2f} deg/s",
                adaptive.peak <= 1.02 * RATE_LIMIT_DEG,
            ),
            (
                what + "B, printed pair",
                "0.0022",
                f"{adaptive.index:.5f}",
                abs(adaptive.index / 0.0022 - 1) < 0.1,
            ),
            (
                what + "B, damped least squares, lambda 0.0571",
                "0.0030 (lambda not printed)",
                f"{damped.index:.5f}",
                abs(damped.index / 0.0030 - 1) < 0.1,
            ),
            (what + "B falls, same lambda", "26.7 %", f"{fall:.1f} %", abs(fall - 26.7) < 5),
            (what + "adaptive damping has the smaller B", "yes", f"{fall:.1f} % less", fall > 0),
            (
                what + "pair found by the genetic algorithm",
                "0.0571, 0.0677",
                f"{pair[0]:.4f}, {pair[1]:.4f}, B {searched['measured'].index:.5f}",
                near,
            ),
            (
                what + "errors largest where the least singular value is",
                "yes",
                f"{_when_worst(adaptive):.1f} s, {_when_least(tracked):.1f} s",
                abs(_when_worst(adaptive) - _when_least(tracked)) < 0.1 * duration,
            ),
            (
                what + "x and z clearly better than damped, the others about the same",
                "yes",
                _directions(adaptive, damped),
                _as_published(adaptive, damped),
            ),
        ]
    return rows


def _claims(found: Mapping[str, Any]) -> str:
    rows = [(*row[:3], "agrees" if row[3] else "does not") for row in claims(found)]
    return "### Published and measured\n\n" + _table(("what", "published", "measured", ""), rows)


def _when_worst(measured: Measured) -> float:
    return float(measured.time[np.argmax(np.linalg.norm(measured.errors[:, :3], axis=1))])


def _when_least(tracked: Any) -> float:
    return float(tracked.time[np.argmin(np.asarray(tracked.singular_values)[:, -1])])


def _ratios(adaptive: Measured, damped: Measured) -> np.ndarray:
    """Largest error of the adaptive damping over that of the plain one, in six directions."""
    return np.abs(adaptive.errors).max(axis=0) / np.abs(damped.errors).max(axis=0)


def _directions(adaptive: Measured, damped: Measured) -> str:
    names = ("x", "y", "z", "about x", "about y", "about z")
    return ", ".join(
        f"{n} {100 * (r - 1):+.0f} %" for n, r in zip(names, _ratios(adaptive, damped), strict=True)
    )


def _as_published(adaptive: Measured, damped: Measured) -> bool:
    ratios = _ratios(adaptive, damped)
    return bool(np.all(ratios[[0, 2]] < 0.9) and np.all(np.abs(ratios[[1, 3, 4, 5]] - 1) < 0.1))


def _cells(measured: Measured) -> list[str]:
    return [
        f"{measured.peak:,.2f}",
        f"{measured.index:.5f}",
        f"{measured.position:.4g}",
        f"{measured.attitude:.4g}",
        f"{measured.end_position:.4g}",
        f"{measured.end_attitude:.4g}",
    ]


_HEADS = (
    "peak rate [deg/s]",
    "B",
    "largest position error [mm]",
    "largest attitude error [deg]",
    "at the end [mm]",
    "at the end [deg]",
)


def _runs(runs: Mapping) -> str:
    rows = [
        [f"{duration:g} s", momentum, method, *_cells(measured)]
        for (duration, momentum, method), (_, measured) in runs.items()
    ]
    return "### Methods, lambda 0.0571, epsilon 0.0677\n\n" + _table(
        ("duration", "momentum", "method", *_HEADS), rows
    )


def _searches(searches: Mapping[float, Mapping]) -> str:
    rows = []
    for duration, found in searches.items():
        kept = found["measured"].peak <= found["limit"] * (1 + 1e-6)
        rows.append(
            [
                f"{duration:g} s",
                f"{found['limit']:.2f}",
                f"{found['lambda_max']:.4f}, {found['epsilon']:.4f}",
                *_cells(found["measured"]),
                "kept" if kept else "broken",
            ]
        )
    return "### The genetic algorithm's pairs\n\n" + _table(
        ("duration", "limit [deg/s]", "pair", *_HEADS, "limit"), rows
    )


def _equal(equal: Mapping[float, Mapping[str, Measured]]) -> str:
    rows = [
        [f"{duration:g} s", name, *_cells(measured)]
        for duration, methods in equal.items()
        for name, measured in methods.items()
    ]
    return "### Adaptive against plain damping, tuned to the same peak rate\n\n" + _table(
        ("duration", "method", *_HEADS), rows
    )


def _postures(postures: Mapping[str, Measured]) -> str:
    rows = [[name, *_cells(measured)] for name, measured in postures.items()]
    return "### The published method from other start postures, 25 s\n\n" + _table(("posture", *_HEADS), rows)


def _freedoms(duration: float, rows: Sequence[Any]) -> str:
    reference = rows[0].measured
    lines = []
    for row in rows:
        found, v = row.measured, row.verification
        gain = 1 / found.over(reference)
        broken = found.peak > reference.peak * (1 + 1e-9)
        lines.append(
            [
                row.freedom,
                row.how,
                f"{found.peak:.3f}{' (broken)' if broken else ''}",
                f"{found.position:.4g}",
                f"{found.attitude:.4g}",
                f"{gain:.3g}",
                f"{100 * row.inside:.0f} %",
                f"{float(v.momentum_drift):.1e}",
                f"{max(float(v.tool_position_difference), float(v.tool_attitude_difference)):.1e}",
            ]
        )
    heads = (
        "freedom used",
        "how",
        "peak rate [deg/s]",
        "largest position error [mm]",
        "largest attitude error [deg]",
        "times less",
        "samples inside the drawn base",
        "momentum drift",
        "re-run differs by [m, rad]",
    )
    return f"### Freedoms, {duration:g} s, peak rate {reference.peak:.3f} deg/s\n\n" + _table(heads, lines)


def _pace(pace: Mapping[str, float]) -> str:
    return (
        f"The exact path from the published posture turns joint 4 by {pace['turn_4']:.0f} deg in all; at "
        f"{pace['peak_25']:.2f} deg/s it needs {pace['needed_25']:.1f} s, at {pace['peak_15']:.2f} deg/s "
        f"{pace['needed_15']:.1f} s, however it is timed."
    )


def _tenth(freedoms: Mapping[float, Sequence[Any]]) -> str:
    """Whether the last motion of each duration has less than a tenth of the error and no higher peak rate."""
    lines = []
    for duration, rows in freedoms.items():
        reference, found = rows[0].measured, rows[-1].measured
        share = found.over(reference)
        inside = f"; {100 * rows[-1].inside:.0f} % of its samples lead through the drawn base"
        reached = share < 0.1 and found.peak <= reference.peak
        lines.append(
            f"{duration:g} s: {100 * share:.2g} % of the error at {found.peak:.3f} against {reference.peak:.3f} deg/s; "
            f"less than a tenth is {'reached' if reached else 'not reached'}{inside}."
        )
    return " ".join(lines)
