"""From the section `hold` to a closed loop that was run: reference, estimator, controller, plant, outcome."""

from __future__ import annotations

from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.compiling import program
from jffsr.crosscheck.compare import attitude_difference
from jffsr.errors import InputError
from jffsr.reactionless.control.computed_torque import ComputedTorque
from jffsr.reactionless.control.errors import Gains
from jffsr.reactionless.control.extreme_learning import HIDDEN, INPUTS, ExtremeLearning
from jffsr.reactionless.control.learnt_load import LearntLoad
from jffsr.reactionless.control.passivity import PassivityBased
from jffsr.reactionless.control.proportional_derivative import ProportionalDerivative
from jffsr.reactionless.estimation.adaptive import AdaptiveReactionless
from jffsr.reactionless.estimation.balance import Load
from jffsr.reactionless.estimation.excitation import SineSum
from jffsr.reactionless.estimation.forgetting import ClockForgetting, InnovationForgetting
from jffsr.reactionless.estimation.least_squares import RecursiveLeastSquares, SlidingWindow
from jffsr.reactionless.estimation.models import KnownLoad, LoadModel, RegressedLoad
from jffsr.reactionless.estimation.parameters import LoadParameters
from jffsr.reactionless.interface import Controller
from jffsr.reactionless.plant import closed_loop
from jffsr.reactionless.plant_mujoco import closed_loop_mujoco
from jffsr.reactionless.plant_run import LoopCode, LoopRun, loop_sentence
from jffsr.reactionless.plant_settings import JointDisturbance, LoopSettings, Sensors, Strike
from jffsr.reactionless.ranges import RangesKept
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.study.reactionless.schema_hold import Hold
from jffsr.tracking.redundancy import range_share
from jffsr.types import Array

_VARIANCE = 1e-2
"""(N m s)^2, r of the least squares: the published form has 1, with which they learn ten times more slowly."""
_STABLE = (LoopCode.KEPT, LoopCode.TORQUE_LIMITED)


@dataclass(frozen=True)
class Held:
    """A hold that was run, the arrays of its `run` on the host.

    base_rate, rad/s, is the root mean square of the base's angular velocity over the last stretch; `allowed` is what
    it may be. turned, rad, between start and end; range_used, the largest share that a joint used of its range, from
    the middle to either bound: above 1 it was left.
    """

    run: LoopRun
    base_rate: float
    turned: float
    range_used: float
    allowed: float

    @property
    def success(self) -> bool:
        """Whether the loop was stable and the base ended still."""
        return self.run.code in _STABLE and self.base_rate <= self.allowed and self.range_used <= 1.0

    @property
    def sentence(self) -> str:
        """What became of it."""
        if int(self.run.code) not in [int(code) for code in _STABLE]:
            return f"the hold failed: {loop_sentence(self.run.code)}"
        if not self.base_rate <= self.allowed:
            return (
                f"the base still turns at {self.base_rate:.2g} rad/s, where {self.allowed:g} rad/s are allowed: hold "
                "for longer, or let another estimator learn the load"
            )
        if not self.range_used <= 1.0:
            return "a joint left its range while it took up the momentum: hold for a shorter time, or start elsewhere"
        return f"the base is held still: {self.base_rate:.2g} rad/s at the end"


def hold_still(
    hold: Hold,
    robot: Robot,
    whole: Robot,
    state: State,
    known: KnownLoad,
    end_effector: str,
    *,
    seeds: int = 1,
    strike: Strike | None = None,
    where: str = "hold",
    in_mujoco: bool = False,
) -> tuple[Held, ...]:
    """Run the hold with so many seeds of noise and disturbance, from hold.seed on.

    `whole` is the plant, robot and load as one, in `state`; the robot alone is what is known of it. known is what the
    estimator "known" is told, and no other; strike, a blow from outside. With in_mujoco MuJoCo moves the plant, under
    the same noise. where: of the section, for the sentences of InputError.
    """
    n, limits, free = robot.num_joints, robot.limits, np.full(robot.num_joints, np.inf)
    excitation = hold.excitation
    reference = AdaptiveReactionless(
        robot,
        load_model(hold, known),
        1 / hold.rate,
        SineSum.spread(n, excitation.si("amplitude"), excitation.slowest, excitation.fastest),
        rate_limit=limits.velocity if hold.limits else free,
        acceleration_limit=limits.acceleration if hold.limits else free,
        attitude_gain=hold.attitude_gain,
        ranges=ranges_kept(hold, robot),
        axes=tuple("xyz".index(axis) for axis in sorted(hold.axes)),
        end_effector=end_effector,
    )
    controller = build_controller(hold, robot, state, where, end_effector)
    settings = replace(loop_settings(hold, robot), strike=strike)
    keys = jnp.stack([jax.random.key(hold.seed + k) for k in range(seeds)])
    if in_mujoco:
        loops = [closed_loop_mujoco(whole, state, reference, controller, settings, key) for key in keys]
        return tuple(_judged(hold, robot, jax.device_get(run)) for run in loops)
    runs = jax.device_get(_runs(whole, state, reference, controller, settings, keys))
    return tuple(_judged(hold, robot, jax.tree.map(lambda x, k=k: x[k], runs)) for k in range(seeds))


def ranges_kept(hold: Hold, robot: Robot) -> RangesKept | None:
    """What leads the joints off the ends of their ranges; None where that is not wanted, or no joint has a range."""
    ends = np.stack([robot.limits.position_lower, robot.limits.position_upper])
    if hold.ranges is None or not np.any(np.all(np.isfinite(ends), axis=0)):
        return None
    return RangesKept(hold.ranges.begin, hold.ranges.gain)


def load_model(hold: Hold, known: KnownLoad) -> LoadModel:
    """What learns the load, by its name."""
    regressions = {
        "innovation_forgetting": RecursiveLeastSquares(
            InnovationForgetting(memory=100.0), variance=_VARIANCE
        ),
        "clock_forgetting": RecursiveLeastSquares(ClockForgetting(), variance=_VARIANCE),
        "sliding_window": SlidingWindow(variance=_VARIANCE),
        "plain": RecursiveLeastSquares(variance=_VARIANCE),
    }
    if hold.estimator in regressions:
        return RegressedLoad(regressions[hold.estimator])
    return known if hold.estimator == "known" else load_parameters(hold)


def load_parameters(hold: Hold) -> LoadParameters:
    """The direct estimator, told how good the sensors are."""
    default = LoadParameters()
    return replace(
        default,
        base_rate_noise=max(hold.sensors.gyro, default.base_rate_noise),
        joint_rate_noise=max(hold.sensors.rate, default.joint_rate_noise),
    )


def build_controller(
    hold: Hold, robot: Robot, state: State, where: str, end_effector: str | None = None
) -> Controller:
    """The controller by its name; an extreme learning machine's input weights are random, by the seed."""
    gains = Gains(
        *(_per_joint(getattr(hold.gains, key), robot, f"{where}.gains.{key}") for key in ("rate", "position"))
    )
    period, q = 1 / hold.rate, np.asarray(state.joint_position)
    if hold.controller == "learnt_load":
        return LearntLoad.of(robot, gains, load_parameters(hold), end_effector)
    if hold.controller == "computed_torque":
        return ComputedTorque.of(robot, gains)
    if hold.controller == "passivity_based":
        if end_effector not in (None, robot.end_effector_names[0]):
            raise InputError(
                f"{where}.controller: 'passivity_based' adapts a load on the first end effector, "
                f"'{robot.end_effector_names[0]}'; found '{end_effector}', take another controller"
            )
        return PassivityBased.of(robot, gains, period=period)
    if hold.controller == "pd":
        return ProportionalDerivative.of(robot, q, gains)
    drawn = np.random.default_rng(hold.seed).uniform(size=HIDDEN * (INPUTS + 1))
    return ExtremeLearning.of(robot, q, drawn, gains, period=period)


def loop_settings(hold: Hold, robot: Robot) -> LoopSettings:
    """Clock, delay, limits, sensors and disturbance."""
    return LoopSettings(
        samples=hold.samples,
        period=1 / hold.rate,
        substeps=hold.substeps,
        delay=hold.delay,
        torque_limit=np.asarray(robot.limits.torque) if hold.limits else np.inf,
        sensors=Sensors(**hold.sensors.model_dump()),
        disturbance=JointDisturbance(hold.disturbance.constant, hold.disturbance.random),
    )


def load_in_tool(tool: Array, tool_rotation: Array, mass: float, position: Array, inertia_I: Array) -> Load:
    """A load whose centre of mass (3,), m, and inertia (3, 3), kg m^2, are given in I, in the frame of a tool at (3,)
    whose rotation (3, 3) leads to I."""
    back = np.asarray(tool_rotation).T
    return Load(np.asarray(mass, float), back @ (np.asarray(position) - tool), back @ inertia_I @ back.T)


@program()
def _runs(whole, state, reference, controller, settings, keys):
    return jax.vmap(lambda key: closed_loop(whole, state, reference, controller, settings, key))(keys)


def _judged(hold: Hold, robot: Robot, run: LoopRun) -> Held:
    rates = np.linalg.norm(run.states.base_twist[:, 3:], axis=1)
    last = run.time >= run.time[-1] - hold.settled
    turned = attitude_difference(run.states.base_quaternion[0], run.states.base_quaternion[-1])
    share, _ = range_share(robot.limits, run.states.joint_position)
    settled = float(np.sqrt(np.mean(rates[last] ** 2)))
    return Held(run, settled, float(turned), float(np.abs(share).max()), hold.base_rate)


def _per_joint(value: float | tuple[float, ...], robot: Robot, where: str) -> np.ndarray:
    if isinstance(value, tuple) and len(value) != robot.num_joints:
        raise InputError(
            f"{where}: found a list of {len(value)}, robot '{robot.name}' has {robot.num_joints} joints"
        )
    return np.broadcast_to(np.asarray(value, float), robot.num_joints).copy()
