"""Panels and names that the replays of several kinds of run share."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from jffsr.study.run_folder import RunFolder
from jffsr.viz.hold import WINDOW, running_rms
from jffsr.viz.replay.replay import Panel

if TYPE_CHECKING:
    from xarray import Dataset

_LEAST = 1e-9


def base_rate(dataset: Dataset) -> Panel:
    """How fast the base turns, without the ripple of a sampled controller."""
    time, spin = dataset["time"].values, np.linalg.norm(dataset["base_twist"].values[:, 3:], axis=1)
    curves = {"rate": positive(np.rad2deg(running_rms(time, spin, WINDOW)))}
    return Panel("base rate, running root mean square", "deg/s", time, curves, logarithmic=True)


def torques(dataset: Dataset) -> Panel:
    """The motors' torques; of sliding joints forces."""
    names = [str(name) for name in dataset["joint"].values]
    values = dataset["joint_torque"].values
    return Panel(
        "joint torques",
        str(dataset["joint_torque"].attrs.get("units", "N m")),
        dataset["time"].values,
        dict(zip(names, values.T, strict=True)),
    )


def positive(values: np.ndarray) -> np.ndarray:
    """What a logarithmic axis can show."""
    return np.maximum(values, _LEAST)


def run_name(folder: RunFolder) -> str:
    """What a run is called."""
    return str(folder.read_summary().get("name", folder.path.name))


def while_finite(dataset: Dataset) -> Dataset:
    """The samples before the first at which a joint's position is not finite: there the motion was lost."""
    finite = np.all(np.isfinite(dataset["joint_position"].values), axis=1)
    return dataset.isel(time=np.flatnonzero(np.cumprod(finite)))
