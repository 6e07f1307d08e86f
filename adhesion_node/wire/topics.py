# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""The topics of the package: relative names, message types and what they mean. Pure data, no ROS."""

from __future__ import annotations

from typing import NamedTuple

FRAME = "track"
"""Frame of every stamped message: x runs along the track."""

TRAIN = "train"
"""Moving frame of the state and joint of the braking curve."""


class Topic(NamedTuple):
    """A topic: its relative name and its message type in ROS 2 spelling."""

    name: str
    type: str


POSITION = Topic("position", "geometry_msgs/msg/PoseWithCovarianceStamped")
BRAKE_PRESSURE = Topic("brake_pressure", "sensor_msgs/msg/FluidPressure")
SPEED = Topic("speed", "geometry_msgs/msg/TwistWithCovarianceStamped")
SENSORS = (POSITION, BRAKE_PRESSURE, SPEED)

TRUTH_STATE = Topic("truth/state", "nav_msgs/msg/Odometry")
TRUTH_MU = Topic("truth/mu", "std_msgs/msg/Float64")
TRUTH = (TRUTH_STATE, TRUTH_MU)

MU = Topic("adhesion/mu", "std_msgs/msg/Float64")
MU_LOWER = Topic("adhesion/mu_lower", "std_msgs/msg/Float64")
DECELERATION = Topic("adhesion/deceleration", "geometry_msgs/msg/AccelWithCovarianceStamped")
STATE = Topic("adhesion/state", "nav_msgs/msg/Odometry")
BRAKING_CURVE = Topic("adhesion/braking_curve", "trajectory_msgs/msg/JointTrajectory")
BRAKING_CURVE_NOMINAL = Topic("adhesion/braking_curve_nominal", "trajectory_msgs/msg/JointTrajectory")
RESULTS = (MU, MU_LOWER, DECELERATION, STATE, BRAKING_CURVE, BRAKING_CURVE_NOMINAL)

ATP_STATUS = Topic("atp/status", "diagnostic_msgs/msg/DiagnosticArray")
DIAGNOSTICS = Topic("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray")
CLOCK = Topic("/clock", "rosgraph_msgs/msg/Clock")

WHEEL_SPEED = Topic("wheel_speed", "sensor_msgs/msg/JointState")
TRACTION_FORCE = Topic("traction_force", "geometry_msgs/msg/WrenchStamped")
CREEP_SENSORS = (WHEEL_SPEED, TRACTION_FORCE)

CREEP_MU_MAX = Topic("creep/mu_max", "std_msgs/msg/Float64")
CREEP_LAMBDA_M = Topic("creep/lambda_m", "std_msgs/msg/Float64")
CREEP_RESULTS = (CREEP_MU_MAX, CREEP_LAMBDA_M)

RECORDED = (*SENSORS, *CREEP_SENSORS, *TRUTH, *RESULTS, *CREEP_RESULTS, ATP_STATUS, DIAGNOSTICS)
"""What the recorder subscribes to; /clock is left out because every message carries its log time."""
