"""A hold made again with MuJoCo as the plant, and how far it is from ours."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from jffsr.crosscheck.compare import attitude_difference
from jffsr.study.reactionless.holding import Held

_FAR = 1e-3
"""rad (and m), between the two motions at any time: feedback keeps what steps of another integrator leave small."""
_RATE = 0.1, 1e-5
"""Share of the base's rate at the end, and rad/s, by which the two may differ."""


@dataclass(frozen=True)
class HoldComparison:
    """One run in both plants: base_rate, rad/s, at the end in MuJoCo, and ours; attitude, rad, and joints, rad or m,
    the largest differences over the run; momentum, N s and N m s, the largest difference of any component."""

    name: str
    base_rate: float
    ours: float
    attitude: float
    joints: float
    momentum: float

    @property
    def passed(self) -> bool:
        """Whether both say the same; NaN does not."""
        share, least = _RATE
        alike = abs(self.base_rate - self.ours) <= share * self.ours + least
        return bool(alike and self.attitude <= _FAR and self.joints <= _FAR)


@dataclass(frozen=True)
class HoldCheck:
    """All runs that were made again."""

    runs: tuple[HoldComparison, ...]

    @property
    def passed(self) -> bool:
        """Whether every run is the same in MuJoCo."""
        return all(run.passed for run in self.runs)

    @property
    def sentence(self) -> str:
        """The verdict in one sentence."""
        wrong = [f"'{run.name}'" for run in self.runs if not run.passed]
        if wrong:
            return f"MuJoCo moves the robot otherwise in {', '.join(wrong)}: refine the step (hold.substeps)."
        return "MuJoCo, moved by the same controllers, says the same of every run."

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and text, ready for JSON."""
        runs = {
            run.name: {key: value for key, value in vars(run).items() if key != "name"} for run in self.runs
        }
        return {"runs": runs, "passed": self.passed, "sentence": self.sentence}

    def to_text(self) -> str:
        """A line for each run, and the sentence below them."""
        lines = [
            f"  {run.name:<26}base {run.base_rate:.3e} rad/s (ours {run.ours:.3e}); apart {run.attitude:.1e} rad, "
            f"joints {run.joints:.1e}"
            for run in self.runs
        ]
        return "\n".join([*lines, self.sentence])


def compared(name: str, mujoco: Held, ours: Held) -> HoldComparison:
    """A run in both plants, sample by sample."""
    theirs, own = mujoco.run.states, ours.run.states
    apart = attitude_difference(theirs.base_quaternion, own.base_quaternion)
    return HoldComparison(
        name,
        mujoco.base_rate,
        ours.base_rate,
        float(apart.max()),
        float(np.abs(theirs.joint_position - own.joint_position).max()),
        float(np.abs(mujoco.run.momentum - ours.run.momentum).max()),
    )


def check_of(pairs: Sequence[tuple[str, Held, Held]]) -> HoldCheck:
    """The check of runs given as (name, in MuJoCo, ours)."""
    return HoldCheck(tuple(compared(*pair) for pair in pairs))
