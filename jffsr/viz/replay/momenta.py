"""Angular momentum of a robot's base and of its arms along a motion, as arrows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.compiling import program
from jffsr.dynamics.kinematics import kinematics, system_com
from jffsr.dynamics.momentum import momentum
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.viz.replay.replay import Arrow, Colour, Replay

BASE_COLOUR: Colour = (0.16, 0.45, 0.85)
ARMS_COLOUR: Colour = (0.92, 0.45, 0.10)
_MOMENTUM = "momentum of the"
_LEAST = 1e-9  # N m s, below which there is nothing to draw


@program(once=True)
def angular_momenta(robot: Robot, states: State):
    """Angular momenta (F, 3), N m s, of the base alone and of everything, about the system's centre of mass, in I."""

    def at(state: State):
        kin = kinematics(robot, state)
        whole = momentum(robot, kin, state.base_twist, state.joint_velocity)
        away = kin.base_position - system_com(robot, kin)
        past = state.base_twist[:3] - whole[:3] / jnp.sum(jnp.asarray(robot.mass))
        spin = kin.inertia_I[0] @ state.base_twist[3:]
        return spin + robot.mass[0] * jnp.cross(away, past), whole[3:]

    return jax.vmap(at)(states)


def momentum_arrows(robot: Robot, states: State, origin: np.ndarray, longest: float) -> tuple[Arrow, ...]:
    """Arrows of the base's and the arms' angular momentum, N m s, from origin (F, 3); the longest is `longest`, m.

    Nothing where the robot hardly has any.
    """
    base, whole = jax.device_get(angular_momenta(robot, states))
    parts = {"base": (base, BASE_COLOUR), "arm": (whole - base, ARMS_COLOUR)}
    largest = max(float(np.linalg.norm(vector, axis=1).max()) for vector, _ in parts.values())
    if not np.isfinite(largest) or largest < _LEAST:
        return ()
    scale = largest / longest
    return tuple(
        Arrow(f"{_MOMENTUM} {name}", origin, vector / scale, colour, scale)
        for name, (vector, colour) in parts.items()
    )


def with_one_scale(replays: Sequence[Replay]) -> list[Replay]:
    """The replays with arrows that can be compared: a metre stands for as much in all, none longer than it was."""
    scale = max((arrow.scale for replay in replays for arrow in replay.arrows), default=1.0)

    def scaled(arrow: Arrow) -> Arrow:
        return replace(arrow, vector=arrow.vector * (arrow.scale / scale), scale=scale)

    return [replace(replay, arrows=tuple(map(scaled, replay.arrows))) for replay in replays]


def _by_line(replays: Sequence[Replay]) -> dict[str, list[str]]:
    """Every sentence of the replays' legends, with the titles of those that it is said of."""
    found: dict[str, list[str]] = {}
    for replay in replays:
        for line in dict.fromkeys(replay.legend):
            found.setdefault(line, []).append(replay.title)
    return found


def legend_of(replays: Sequence[Replay]) -> list[str]:
    """What there is to know of replays that are seen together, in sentences."""
    lines = [
        line if len(named) == len(replays) else f"{', '.join(named)}: {line}"
        for line, named in _by_line(replays).items()
    ]
    arrows = [arrow for replay in replays for arrow in replay.arrows if arrow.name.startswith(_MOMENTUM)]
    if arrows:
        largest = max(arrow.scale * np.linalg.norm(arrow.vector, axis=1).max() for arrow in arrows)
        lines.append(
            "Arrows: the robot's angular momentum about its centre of mass, a load not counted: "
            "blue of the base, orange of the arm; "
            f"the longest is {largest:.3g} N m s."
        )
    return lines
