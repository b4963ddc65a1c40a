"""The tool goes round a circle while the base floats: held rates drift off it, feedback brings them back."""

import sys

import jax
import numpy as np

import jffsr

jax.config.update("jax_enable_x64", True)


def main(small: bool = False) -> dict[str, jffsr.Tracked]:
    robot = jffsr.load_robot("servicer_7dof")
    state = jffsr.State(np.zeros(3), np.array([1.0, 0, 0, 0]), np.deg2rad([0, -60, 0, 45, 0, -15, 0]))
    position, quaternion = jffsr.end_effector_pose(robot, jffsr.kinematics(robot, state))
    centre = np.asarray(position) + np.array([0.0, 0.0, 0.1])
    circle = jffsr.Arc.about(centre, [1.0, 0.0, 0.0], (position, quaternion), 2 * np.pi)
    target = jffsr.ToolTrajectory(circle, jffsr.Quintic.over(60.0))
    tracked = {}
    for label, gain in {"as planned": 0.0, "fed back": 0.5}.items():
        tracker = jffsr.Tracker(method="damped", damping=0.01, position_gain=gain, attitude_gain=gain)
        found = jffsr.track(robot, target, state, tracker, num_samples=60 if small else 240)
        errors = jffsr.pose_errors(found)
        turn = 2 * np.arccos(np.clip(np.abs(found.motion.base_quaternion[:, 0]), 0, 1))
        print(
            f"{label}: tool off by up to {1e3 * errors.position_peak:.3g} mm, "
            f"base turned by up to {np.rad2deg(turn.max()):.2f} deg"
        )
        tracked[label] = found
    return tracked


if __name__ == "__main__":
    main(small="--small" in sys.argv)
