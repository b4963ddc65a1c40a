"""A robot of two arms in files of their own, and a study of it."""

TWINS = """\
name: twins
base: {name: bus, mass: 800, inertia: {xx: 300, yy: 310, zz: 320}}
arms:
  - {robot: hu_planar2, base: drop, prefix: left_, position: [0, 0.5, 0], rpy_deg: [0, 0, 90]}
  - {robot: ../arms/right.yaml, link: bus, position: [0.1, -0.5, 0], rpy_deg: [0, 0, -90]}
payloads:
  - name: crate
    end_effector: left_tip
    mass: 25
    com: [0.2, 0, 0]
    inertia: {xx: 1, yy: 2, zz: 2}
    position: [0.1, 0, 0]
"""
RIGHT = """\
name: right
base: {name: foot, mass: 5, inertia: {xx: 0.1, yy: 0.1, zz: 0.1}}
arms: [{robot: ye_planar3, base: drop, prefix: right_}]
"""
STUDY = """\
kind: planning
robot: ../robots/twins.yaml
limits: {position_deg: 100, rate: 0.3, acceleration: 0.2}
task: {start_deg: [10, 10, 10, 10, 10], goal_deg: [20, 20, 20, 20, 20], duration: 20}
"""
