"""A planar arm grasps a handle on a box that drifts and turns: time, posture and motion are found together."""

import sys

import jax
import numpy as np

import jffsr
from jffsr.capture.candidates import CandidateSettings

jax.config.update("jax_enable_x64", True)


def main(small: bool = False) -> jffsr.CapturePlan:
    bus = jffsr.RigidBody.create(mass=1000.0, inertia=[300.0, 300.0, 300.0], name="bus")
    robot = jffsr.attach(bus, jffsr.load_robot("ye_planar3"), arm_base="drop")
    limits = jffsr.Limits.symmetric(position=np.deg2rad(140), velocity=0.15, acceleration=0.05, num_joints=3)
    robot = robot.replace(limits=limits)
    upright = np.array([1.0, 0, 0, 0])
    start = jffsr.State(np.zeros(3), upright, np.array([1.8, -2.2, 0.9]))
    box = jffsr.Target.create((2.0, 2.5, 3.0), 10.0, grasps={"handle": ((-0.4, 0.1, 0.0), upright)})
    seen = jffsr.TargetState.create((3.4, 0.7, 0.0), (-0.005, 0.005, 0.0), upright, (0.0, 0.0, 0.02))
    motion = jffsr.target_motion(box, seen, duration=41.0)
    path = jffsr.GraspPath.create(motion, "handle")
    settings = jffsr.CaptureSettings(CandidateSettings(window=(15.0, 40.0), times=2), num_steps=40, lanes=8)
    plan = jffsr.plan_capture(robot, path, start, None, settings, improve=1 if small else 3)
    print(plan.result.sentence)
    if not plan.result.success:
        return plan
    print(f"grasped after {plan.duration:.1f} s, errors {np.abs(plan.error).max():.1e} m, rad, m/s, rad/s")
    print(f"base disturbance {plan.cost:.4f}, at first {plan.before:.4f}")
    return plan


if __name__ == "__main__":
    main(small="--small" in sys.argv)
