"""jffsr: motion planning for free-floating space robots in JAX.

The public names, listed by hand. They are resolved on first use (PEP 562), so that importing the package
costs nothing and changes no setting of JAX.
"""

from __future__ import annotations

import importlib
from typing import Any

__version__ = "0.1.0"

_HOME = {
    "InputError": "jffsr.errors",
    "Robot": "jffsr.robots.robot",
    "Limits": "jffsr.robots.robot",
    "RigidBody": "jffsr.robots.rigid_body",
    "attach": "jffsr.robots.composing.composition",
    "weld": "jffsr.robots.composing.composition",
    "State": "jffsr.robots.state",
    "perturbed": "jffsr.robots.perturbation",
    "Design": "jffsr.robots.design",
    "redesigned": "jffsr.robots.design",
    "load_robot": "jffsr.robots.loading",
    "list_robots": "jffsr.robots.loading",
    "to_urdf": "jffsr.robots.formats.export_urdf",
    "to_mjcf": "jffsr.robots.formats.export_mjcf",
    "save_robot": "jffsr.robots.formats.saving",
    "Kinematics": "jffsr.dynamics.kinematics",
    "kinematics": "jffsr.dynamics.kinematics",
    "system_com": "jffsr.dynamics.kinematics",
    "end_effector_pose": "jffsr.dynamics.kinematics",
    "jacobians": "jffsr.dynamics.kinematics",
    "inertia_blocks": "jffsr.dynamics.momentum",
    "generalized_inertia": "jffsr.dynamics.momentum",
    "momentum": "jffsr.dynamics.momentum",
    "base_twist": "jffsr.dynamics.momentum",
    "generalized_jacobian": "jffsr.dynamics.momentum",
    "kinetic_energy": "jffsr.dynamics.momentum",
    "bias_force": "jffsr.dynamics.equations_of_motion",
    "inverse_dynamics": "jffsr.dynamics.equations_of_motion",
    "forward_dynamics": "jffsr.dynamics.equations_of_motion",
    "SinePolynomial": "jffsr.trajectories.sine_polynomial",
    "Polynomial": "jffsr.trajectories.polynomial",
    "ClampedBSpline": "jffsr.trajectories.bspline",
    "euler_to_quaternion": "jffsr.spatial.euler",
    "quaternion_to_euler": "jffsr.spatial.euler",
    "Line": "jffsr.trajectories.cartesian.line",
    "Waypoints": "jffsr.trajectories.cartesian.waypoints",
    "Arc": "jffsr.trajectories.cartesian.arc",
    "PoseSpline": "jffsr.trajectories.cartesian.pose_spline",
    "ToolTrajectory": "jffsr.trajectories.cartesian.tool_trajectory",
    "Trapezoid": "jffsr.trajectories.cartesian.timing",
    "Quintic": "jffsr.trajectories.cartesian.timing",
    "Tabulated": "jffsr.trajectories.cartesian.tabulated",
    "rate_bound": "jffsr.trajectories.cartesian.fastest",
    "fastest_timing": "jffsr.trajectories.cartesian.fastest",
    "fastest_tool_timing": "jffsr.trajectories.cartesian.fastest_tool",
    "Motion": "jffsr.rollouts.motion",
    "rollout": "jffsr.rollouts.rollout",
    "reference_rollout": "jffsr.rollouts.reference",
    "joint_torque": "jffsr.rollouts.joint_torque",
    "DrivenMotion": "jffsr.rollouts.torque_driven",
    "torque_rollout": "jffsr.rollouts.torque_driven",
    "map_batch": "jffsr.parallel.mapping",
    "use_all_cores": "jffsr.parallel.cores",
    "crosscheck_many": "jffsr.crosscheck.mjx_batch",
    "CompositeIndex": "jffsr.objectives.composite",
    "minimize": "jffsr.optimizers.minimize",
    "pareto": "jffsr.optimizers.pareto",
    "ParetoSet": "jffsr.optimizers.pareto",
    "FinalAttitude": "jffsr.objectives.constraints",
    "JointLimits": "jffsr.objectives.constraints",
    "BaseExcursion": "jffsr.objectives.constraints",
    "joint_limits": "jffsr.objectives.constraints",
    "Problem": "jffsr.planning.problem",
    "Plan": "jffsr.planning.plan",
    "plan_many": "jffsr.planning.many",
    "Uncertainty": "jffsr.planning.uncertainty",
    "index_over": "jffsr.planning.spread",
    "CoDesign": "jffsr.planning.codesign",
    "design_gradient": "jffsr.planning.codesign",
    "plan_pareto": "jffsr.planning.pareto",
    "check_tracked": "jffsr.tracking.mujoco_check",
    "track": "jffsr.tracking.tracking",
    "Tracker": "jffsr.tracking.tracker",
    "Tracked": "jffsr.tracking.tracked",
    "track_rates": "jffsr.tracking.tracking",
    "fastest_tracking": "jffsr.tracking.retiming",
    "refine_tracking": "jffsr.tracking.refinement",
    "errors_between": "jffsr.tracking.between_samples",
    "verify_tracking": "jffsr.tracking.verification",
    "pose_errors": "jffsr.tracking.indices",
    "tuning": "jffsr.tracking.tuning",
    "BaseAttitudeHeld": "jffsr.tracking.redundancy",
    "JointLimitAvoidance": "jffsr.tracking.redundancy",
    "ManipulabilityGradient": "jffsr.tracking.redundancy",
    "singularities": "jffsr.tracking.singularity.along",
    "SingularityReport": "jffsr.tracking.singularity.report",
    "Postures": "jffsr.tracking.singularity.between",
    "singularity_scan": "jffsr.tracking.singularity.scan",
    "Target": "jffsr.target.body",
    "TargetState": "jffsr.target.target_state",
    "TargetMotion": "jffsr.target.tumbling",
    "target_motion": "jffsr.target.tumbling",
    "grasp_frame": "jffsr.target.grasp_frames",
    "Camera": "jffsr.target.camera",
    "Measurements": "jffsr.target.camera",
    "sample_times": "jffsr.target.camera",
    "observe_target": "jffsr.target.camera",
    "TargetPrior": "jffsr.target.prior",
    "TargetEstimate": "jffsr.target.estimate",
    "ProcessNoise": "jffsr.target.filter_steps",
    "FilterSettings": "jffsr.target.filter",
    "FilteredTarget": "jffsr.target.filter",
    "filter_target": "jffsr.target.filter",
    "GraspPrediction": "jffsr.target.prediction",
    "ConvergenceTolerances": "jffsr.target.prediction",
    "predict_grasp": "jffsr.target.prediction",
    "has_converged": "jffsr.target.prediction",
    "convergence": "jffsr.target.prediction",
    "Settings": "jffsr.optimizers.registry",
    "composite_index": "jffsr.objectives.composite",
    "solve": "jffsr.planning.plan",
    "plan": "jffsr.study.planning",
}

__all__ = ["__version__", *_HOME]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'jffsr' has no attribute '{name}'")
    return getattr(importlib.import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)
