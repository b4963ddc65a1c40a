"""Made-up captures in the form of result.nc: a criterion's curves, and a motion to a grasp frame at rest."""

from __future__ import annotations

import numpy as np
import xarray as xr

from jffsr.study.capture.dataset import ERRORS

SAMPLES, UNIT = 11, np.array([1.0, 0.0, 0.0, 0.0])


def scan_dataset(code: int = 0) -> xr.Dataset:
    """Two frames' criteria over 40 s, the second chosen at 20 s."""
    time = np.linspace(0.0, 40.0, 81)
    value = np.stack([2.0 + 0.01 * time, 1.0 + (time - 20.0) ** 2 / 400])
    curves = {name: (("grasp", "scan_time"), np.ones((2, 81))) for name in ("grasp_distance", "grasp_share")}
    curves |= {
        name: (("grasp", "scan_time"), np.ones((2, 81), bool)) for name in ("grasp_near", "grasp_feasible")
    }
    candidates = {
        "grasp": [1, 0],
        "time": [20.0, 0.0],
        "value": [1.0, 2.0],
        "share": [1.0, 1.0],
        "chosen": [1, 0],
    }
    return xr.Dataset(
        {
            "criterion": (("grasp", "scan_time"), value),
            "grasp_facing": (("grasp", "scan_time"), 0.5 * np.ones((2, 81))),
            **curves,
            **{f"candidate_{key}": ("candidate", np.array(column)) for key, column in candidates.items()},
        },
        coords={"grasp": ["handle", "ring"], "scan_time": time},
        attrs={"grasp_time_code": code, "grasp_time_sentence": "grasp 'ring' at 20 s", "margin": 0.02},
    )


def motion_dataset(joints: int) -> xr.Dataset:
    """A tool that comes to a resting grasp frame with errors t^2 before the end, joints that stay."""
    time = np.linspace(0.0, 20.0, SAMPLES)
    left = (20.0 - time)[:, None]
    error = np.concatenate([1e-3 * left**2 * np.ones((1, 6)), 2e-3 * left * np.ones((1, 6))], axis=1)
    grasp = np.tile([2.0, 0.1, -1.0], (SAMPLES, 1))
    joint = ("time", "joint")
    zeros = np.zeros((SAMPLES, joints))
    limits = {
        "joint_position_lower": -2.0,
        "joint_position_upper": 2.0,
        "joint_velocity_limit": 0.2,
        "joint_acceleration_limit": 0.1,
    }
    return xr.Dataset(
        {
            "joint_position": (joint, zeros + 0.3),
            "joint_velocity": (joint, zeros),
            "joint_acceleration": (joint, zeros),
            "base_position": (("time", "axis"), np.zeros((SAMPLES, 3))),
            "base_quaternion": (("time", "component"), np.tile(UNIT, (SAMPLES, 1))),
            "attitude_angle": (("time", "axis"), np.zeros((SAMPLES, 3))),
            "excursion_limit": ("axis", np.full(3, np.inf)),
            "tool_position": (("time", "axis"), grasp + error[:, :3]),
            "tool_twist": (("time", "twist"), error[:, 6:]),
            "grasp_position": (("time", "axis"), grasp),
            "grasp_quaternion": (("time", "component"), np.tile(UNIT, (SAMPLES, 1))),
            "grasp_twist": (("time", "twist"), np.zeros((SAMPLES, 6))),
            "grasp_error": (("time", "error"), error),
            "target_position": (("time", "axis"), grasp + np.array([0.3, 0.0, 0.0])),
            "target_quaternion": (("time", "component"), np.tile(UNIT, (SAMPLES, 1))),
            **{name: ("joint", np.full(joints, value)) for name, value in limits.items()},
        },
        coords={
            "time": time,
            "joint": [f"joint{i + 1}" for i in range(joints)],
            "axis": list("xyz"),
            "component": list("wxyz"),
            "error": list(ERRORS),
        },
    )
