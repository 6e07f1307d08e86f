# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The table of topics: the one place that says a topic's name, type, role, quality of service, frame and codec.

Pure data, no ROS. Names are relative, so that namespaces separate trains.
"""

from .messages import curves, positions, results, sensors
from .messages.codec import Codec
from .topic import Frame, Quality, Role, Topic


def _sensor(name: str, type_name: str, codec: Codec, meaning: str, frame: Frame = Frame.ANY) -> Topic:
    return Topic(name, type_name, Role.SENSOR, Quality.SENSOR, frame, codec, meaning)


def _result(name: str, type_name: str, codec: Codec, meaning: str, quality: Quality = Quality.RESULT) -> Topic:
    return Topic(name, type_name, Role.ADHESION, quality, Frame.LINE, codec, meaning)


def _number(name: str, role: Role, codec: Codec, meaning: str) -> Topic:
    quality = Quality.SENSOR if role is Role.TRUTH else Quality.RESULT
    return Topic(name, "std_msgs/msg/Float64", role, quality, Frame.ANY, codec, meaning)


def _curve(name: str, codec: Codec, meaning: str) -> Topic:
    return _result(name, "trajectory_msgs/msg/JointTrajectory", codec, meaning, Quality.EXPIRING)


def _status(name: str, meaning: str) -> Topic:
    kind = "diagnostic_msgs/msg/DiagnosticArray"  # shared with everybody, whatever their frame
    return Topic(name, kind, Role.STATUS, Quality.RESULT, Frame.ANY, results.STATUS, meaning)


POSITION = _sensor(
    "position",
    "geometry_msgs/msg/PoseWithCovarianceStamped",
    positions.POSITION,
    "**in**: measured position of the front end along the track, pose.position.x m, covariance[0] m²; 0 is unknown: "
    "`position_std_m`",
    Frame.LINE,
)
FIX = _sensor(
    "fix",
    "sensor_msgs/msg/NavSatFix",
    positions.FIX,
    "**in**, instead of `position`, with `track_line`: latitude and longitude, projected on that line; the covariance "
    "along it, `position_std_m` where it is 0 or of type unknown",
)
ODOMETRY = _sensor(
    "odometry",
    "nav_msgs/msg/Odometry",
    positions.ODOMETRY,
    "**in**, instead of `position`: the same by pose.pose.position.x and its covariance[0]; the twist is not used",
    Frame.LINE,
)
BRAKE_PRESSURE = _sensor(
    "brake_pressure",
    "sensor_msgs/msg/FluidPressure",
    sensors.BRAKE_PRESSURE,
    "**in**: brake cylinder, **absolute** Pa; of one, the mean or what is demanded (`pressure_kind`)",
)
BRAKE_DEMAND = _sensor(
    "brake_demand",
    "sensor_msgs/msg/FluidPressure",
    sensors.BRAKE_DEMAND,
    "**in**, optional: cylinder pressure that the handle or valve demands, **absolute** Pa",
)
SPEED = _sensor(
    "speed",
    "geometry_msgs/msg/TwistWithCovarianceStamped",
    sensors.SPEED,
    "**in**, optional: m/s, covariance[0] (m/s)², 0 = unknown; of an axle used while coasting only, as a braked one "
    "slides (`speed_source`)",
)
IMU = _sensor(
    "imu",
    "sensor_msgs/msg/Imu",
    sensors.IMU,
    "**in**, optional: linear_acceleration.x m/s², forward along the track, its covariance[0], 0 = unknown, -1 = none; "
    "gravity on y and z, where it is there, tells whether the unit is right",
)
WHEEL_SPEED = _sensor(
    "wheel_speed",
    "sensor_msgs/msg/JointState",
    sensors.WHEEL_SPEED,
    "**in**, optional: rad/s, forward along the run, one velocity per axle, NaN where it has none. Sliding wheels "
    "show that adhesion limits, rolling ones that the brake does. **In** of `creep_estimator`: the driven axles",
)
TRACTION_FORCE = _sensor(
    "traction_force",
    "geometry_msgs/msg/WrenchStamped",
    sensors.TRACTION_FORCE,
    "**in** of `creep_estimator`: force.x N, all driven axles together, at the rim",
)

TRUTH_STATE = Topic(
    "truth/state",
    "nav_msgs/msg/Odometry",
    Role.TRUTH,
    Quality.SENSOR,
    Frame.LINE,
    results.STATE,
    "simulators only: position and speed as they are",
)
TRUTH_MU = _number(
    "truth/mu",
    Role.TRUTH,
    results.NUMBER,
    "simulators only: the available adhesion; of a real train the one that its force *uses*, as that stops it; of "
    "`slip_simulator` the peak",
)
TRUTH_LIMITED = Topic(
    "truth/limited",
    "std_msgs/msg/Bool",
    Role.TRUTH,
    codec=results.FLAG,
    meaning="simulators only, of a real train: whether its adhesion limits, as half of its axle groups slide by turns",
)

MU = _number("adhesion/mu", Role.ADHESION, results.MU, "μ̂, one per estimate, for plots: it has no stamp")
MU_LOWER = _number(
    "adhesion/mu_lower",
    Role.ADHESION,
    results.MU_LOWER,
    "its lower bound at the one-sided `confidence`, likewise",
)
DECELERATION = _result(
    "adhesion/deceleration",
    "geometry_msgs/msg/AccelWithCovarianceStamped",
    results.DECELERATION,
    "−μ̂ g, m/s², and its variance, stamped: the form for machines",
)
DECELERATION_LOWER = _result(
    "adhesion/deceleration_lower",
    "geometry_msgs/msg/AccelWithCovarianceStamped",
    results.DECELERATION_LOWER,
    "the same of the lower bound at `confidence`, with the same variance: bound and σ, stamped",
)
STATE = _result(
    "adhesion/state", "nav_msgs/msg/Odometry", results.ESTIMATED_STATE, "position and speed with their variances"
)
BRAKING_CURVE = _curve(
    "adhesion/braking_curve",
    curves.SAFE,
    "full braking to standstill, the safe curve: on what the way ahead surely gives, by methods of windows on "
    "`mu_lower`; 64 points, joint `train`",
)
BRAKING_CURVE_NOMINAL = _curve("adhesion/braking_curve_nominal", curves.NOMINAL, "the same on μ̂")

CREEP_MU_MAX = _number(
    "creep/mu_max",
    Role.CREEP,
    results.CREEP_MU_MAX,
    "the peak of the creep curve; nothing while the data cannot tell it",
)
CREEP_LAMBDA_M = _number("creep/lambda_m", Role.CREEP, results.CREEP_LAMBDA_M, "the creep at that peak")

ATP_TARGET = Topic(
    "atp/target",
    "trajectory_msgs/msg/JointTrajectory",
    Role.COMMAND,
    Quality.RESULT,
    Frame.LINE,
    curves.TARGET,
    "**in** of `atp_monitor`: a new target; joint `train`, one point: its chainage, m, and the speed allowed, m/s",
)
ATP_STATUS = _status("atp/status", "supervision: `level`, its limits in m/s, distance and margin in m")
DIAGNOSTICS = _status(
    "/diagnostics",
    "regime, window, ESS, drops by reason, digest; of `creep_estimator` p₁, p₂, the peak with its standard "
    "deviation and bounds, whether and why it is withheld",
)
CLOCK = Topic(
    "/clock",
    "rosgraph_msgs/msg/Clock",
    Role.CLOCK,
    Quality.SENSOR,
    Frame.ANY,
    results.CLOCK,
    "time of a simulated or replayed run; the nodes follow it with `use_sim_time`",
)

TOPICS = tuple(value for value in tuple(globals().values()) if isinstance(value, Topic))
"""All of the above, in this order: a topic stands once."""


def topics_of(*roles: Role) -> tuple[Topic, ...]:
    """Return the topics that are the one or the other to the package."""
    return tuple(topic for topic in TOPICS if topic.role in roles)


SENSORS, TRUTH = topics_of(Role.SENSOR), topics_of(Role.TRUTH)
RESULTS, CREEP_RESULTS = topics_of(Role.ADHESION), topics_of(Role.CREEP)
"""In the order of publishing."""

RECORDED = tuple(topic for topic in TOPICS if topic.role is not Role.CLOCK)
"""What the recorder subscribes to; /clock is left out because every message carries its log time."""

POSITIONS = (FIX, POSITION, ODOMETRY)
"""What can give the positions: where there are several, the first of these that is heard."""

ADHESION_INPUTS = (BRAKE_PRESSURE, BRAKE_DEMAND, SPEED, IMU, WHEEL_SPEED, *POSITIONS)
CREEP_INPUTS = (SPEED, TRACTION_FORCE, WHEEL_SPEED)
"""What the estimators take in. The last one, or one of `POSITIONS`, is that without which there is no estimate."""
