"""The target as a camera has observed it before the robot starts: estimated, predicted, and how well that is known."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import numpy as np

from jffsr.capture.grasp_path import GraspPath
from jffsr.compiling import program
from jffsr.robots.geometry import Geometry
from jffsr.study.capture.building import CaptureStudy, moving
from jffsr.study.capture.schema_observation import Observation
from jffsr.target.body import Target
from jffsr.target.camera import Camera, Measurements, observe_target, sample_times
from jffsr.target.estimate import TargetEstimate
from jffsr.target.estimated import estimated_geometry, estimated_target
from jffsr.target.filter import FilteredTarget, FilterSettings, filter_target
from jffsr.target.prediction import ConvergenceTolerances, GraspPrediction, has_converged, predict_grasp
from jffsr.target.prior import TargetPrior
from jffsr.target.tumbling import TargetMotion, state_before, target_motion


@dataclass(frozen=True)
class ObservedTarget:
    """What the robot knows when it starts: the last estimate, `age` s old, and the motion predicted from it.

    target has its shapes in `geometry` and its axes are the marker's; motion begins at the estimate, so that the robot
    starts at its time `age`; exposures, of which `seen` gave a pose; of those after the acquisition (`filtered`) the
    filter believed in `used`; lost, whether it has lost the track; tolerances of the prediction; measurements and
    course, every pose and every estimate, by a clock that began at `started` of the robot's, s.
    """

    estimate: TargetEstimate
    target: Target
    geometry: Geometry
    motion: TargetMotion
    age: float
    exposures: int
    seen: int
    filtered: int
    used: int
    lost: bool
    tolerances: ConvergenceTolerances
    measurements: Measurements
    course: FilteredTarget
    started: float

    def path(self, grasp: str) -> GraspPath:
        """Where the grasp frame is predicted to be, by the robot's time."""
        return GraspPath.create(self.motion, grasp, self.age)

    def prediction(self, true_target: Target, grasp: str, time: float) -> GraspPrediction:
        """The grasp frame `time` s after the robot starts, with its covariance."""
        frame = true_target.grasp_in_marker(grasp)
        return jax.device_get(predict_grasp(self.estimate, self.age + time, frame))

    def converged(self, prediction: GraspPrediction) -> bool:
        """Whether the covariance says that the prediction is good enough; never where the track is lost."""
        return not self.lost and bool(has_converged(prediction, self.tolerances))


def observe(study: CaptureStudy, section: Observation, last: float) -> ObservedTarget:
    """The target observed until the camera's delay before the robot starts, and predicted to `last` s after that."""
    camera = _camera(section)
    count = section.poses
    age = camera.delay
    before = (count - 1) / camera.rate
    past = state_before(study.target, study.target_state, age + before)
    states = jax.vmap(target_motion(study.target, past, age + before))(sample_times(camera, count))
    key = jax.random.key(section.seed)
    measurements = observe_target(study.target, states, camera, key)
    settings = FilterSettings(acquisition=section.acquisition)
    course = jax.device_get(_filtered(measurements, _prior(section), camera, settings))
    estimate = jax.tree.map(lambda x: x[-1], course.estimate)
    target = estimated_target(study.target, estimate)
    wanted = section.convergence
    return ObservedTarget(
        estimate,
        target,
        estimated_geometry(study.target, study.geometry, estimate),
        moving(target, estimate.state, age + last),
        age,
        count,
        int(np.sum(measurements.seen)),
        int(np.sum(measurements.seen[section.acquisition :])),
        int(np.sum(course.used)),
        bool(course.lost[-1]),
        ConvergenceTolerances(
            wanted.position,
            wanted.si("attitude"),
            wanted.linear_velocity,
            wanted.si("angular_velocity"),
            wanted.confidence,
        ),
        jax.device_get(measurements),
        course,
        -(age + before),
    )


@program(static_argnums=(2, 3))
def _filtered(
    measurements: Measurements, prior: TargetPrior, camera: Camera, settings: FilterSettings
) -> FilteredTarget:
    return filter_target(measurements, camera, prior, settings)


def _camera(section: Observation) -> Camera:
    wanted = section.camera
    camera = Camera(
        wanted.rate,
        wanted.position_deviation,
        wanted.si("attitude_deviation"),
        wanted.delay,
        wanted.dropouts,
        wanted.outliers,
        wanted.outlier_factor,
    )
    return camera.scaled(wanted.noise)


def _prior(section: Observation) -> TargetPrior:
    wanted = section.prior
    return TargetPrior.create(
        inertia=np.array(wanted.inertia),
        angular_velocity_deviation=wanted.si("angular_velocity_deviation"),
        inertia_deviation=wanted.inertia_deviation,
        velocity_deviation=wanted.velocity_deviation,
        offset_deviation=wanted.offset_deviation,
    )
