"""Small made-up runs in the form of result.nc: smooth curves, no physics."""

from __future__ import annotations

import json

import numpy as np
import xarray as xr

SAMPLES = 41


def run_dataset(
    joints: int | list[str] = 6,
    rate_limit: float | list[float] = np.inf,
    excursion_limit: float = np.inf,
    best: tuple[float, ...] = (np.inf, 900.0, 40.0, 2.0, 0.3),
    phases: tuple[int, ...] = (0, 0, 1, 1, 2),
) -> xr.Dataset:
    """A run of 10 s: joints swing by up to 1 rad at up to about 0.31 rad/s, the base turns by up to 5 deg."""
    names = [f"joint{i + 1}" for i in range(joints)] if isinstance(joints, int) else joints
    count, time = len(names), np.linspace(0.0, 10.0, SAMPLES)
    phase = 2 * np.pi * np.arange(count) / max(count, 1)
    angle = np.pi * time[:, None] / 10.0 + phase
    turn = np.deg2rad(5.0) * np.sin(np.pi * time[:, None] / 10.0) * np.array([0.0, 0.0, 1.0])
    half = 0.5 * turn[:, 2]
    counts = np.arange(1, len(best) + 1)
    limit = np.broadcast_to(np.asarray(rate_limit, float), (count,))
    return xr.Dataset(
        {
            "joint_position": (("time", "joint"), np.sin(angle)),
            "joint_velocity": (("time", "joint"), np.pi / 10 * np.cos(angle)),
            "joint_acceleration": (("time", "joint"), -((np.pi / 10) ** 2) * np.sin(angle)),
            "base_position": (("time", "axis"), 0.3 * turn),
            "base_quaternion": (
                ("time", "component"),
                np.stack([np.cos(half), 0 * half, 0 * half, np.sin(half)], axis=1),
            ),
            "attitude_angle": (("time", "axis"), turn),
            "joint_position_lower": ("joint", np.full(count, -np.inf)),
            "joint_position_upper": ("joint", np.full(count, np.inf)),
            "joint_velocity_limit": ("joint", limit),
            "joint_acceleration_limit": ("joint", np.full(count, np.inf)),
            "excursion_limit": ("axis", np.full(3, excursion_limit)),
            "history_phase": ("iteration", np.array(phases, dtype=int)),
            "history_evaluations": ("iteration", 50 * np.minimum(counts, 2)),
            "history_gradient_evaluations": ("iteration", 4 * np.maximum(counts - 2, 0)),
            "history_best_value": ("iteration", np.array(best)),
        },
        coords={"time": time, "joint": names, "axis": list("xyz"), "component": list("wxyz")},
        attrs={"phase_names": json.dumps(["swarm", "gradient", "polish"]), "accuracy": 1.0},
    )
