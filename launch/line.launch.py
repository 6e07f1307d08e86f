# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A whole line in simulated time: simulator, estimator, ATP monitor and, if wanted, recorder and live page.

ros2 launch adhesion_node line.launch.py scenario:=tunnel_exit record:=my_run live:=true
"""

from launch.actions import DeclareLaunchArgument, Shutdown
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution, PythonExpression
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

from launch import LaunchDescription

ARGUMENTS = {
    "namespace": ("", "of all nodes: it keeps trains apart"),
    "params_file": (
        PathJoinSubstitution([FindPackageShare("adhesion_node"), "config", "defaults.yaml"]),
        "parameters of all nodes",
    ),
    "use_sim_time": ("true", "follow /clock, which the simulator gives"),
    "scenario": ("tunnel_exit", "what happens"),
    "fault": ("none", "what goes wrong"),
    "record": ("", "new directory for a recording; none without"),
    "live": ("false", "serve the page http://127.0.0.1:8080/"),
}


def generate_launch_description() -> LaunchDescription:
    """Describe the line; it ends with its scenario."""
    declared = [
        DeclareLaunchArgument(name, default_value=usual, description=meaning)
        for name, (usual, meaning) in ARGUMENTS.items()
    ]
    given = {name: LaunchConfiguration(name) for name in ARGUMENTS}
    recorded = PythonExpression(["'", given["record"], "' != ''"])
    # The estimator is awaited, and who else takes positions in.
    awaited = PythonExpression(["1 + ('", given["record"], "' != '') + ('", given["live"], "' == 'true')"])

    def node(executable: str, *arguments: object, **more: object) -> Node:
        return Node(
            package="adhesion_node",
            executable=executable,
            namespace=given["namespace"],
            arguments=list(arguments),
            output="screen",
            **more,
        )

    simulated = {"use_sim_time": given["use_sim_time"]}
    following = [given["params_file"], simulated]  # the file first, or what it mentions would hold against the rest
    happening = {"scenario": given["scenario"], "fault": given["fault"], "wait_for": awaited}
    return LaunchDescription(
        [
            *declared,
            node("estimator", parameters=following, respawn=True, respawn_delay=1.0),
            node("atp_monitor", parameters=following, respawn=True, respawn_delay=1.0),
            node("recorder", "--output", given["record"], parameters=[simulated], condition=IfCondition(recorded)),
            node("live", parameters=[simulated], condition=IfCondition(given["live"])),
            node("simulator", parameters=[given["params_file"], happening], on_exit=Shutdown()),
        ]
    )
