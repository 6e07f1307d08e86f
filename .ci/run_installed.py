# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Start the colcon-built estimator as `ros2 run` would, wait until it listens, stop it with SIGINT.

Usage: run_installed.py INSTALL, with INSTALL/setup.bash sourced.
"""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import rclpy
from ament_index_python.packages import get_package_prefix, get_package_share_directory

import adhesion_node

PACKAGE = "adhesion_node"
NAMESPACE = f"/ci_{os.getpid()}"
"""Its own, so that no other estimator of this machine is taken for the one under test."""
TOPIC = f"{NAMESPACE}/position"
START_TIMEOUT_S = 60.0
STOP_TIMEOUT_S = 20.0


def main() -> int:
    """Return 0 when the estimator comes up from the workspace and ends with exit code 0."""
    install = Path(sys.argv[1]).resolve()
    prefix = Path(get_package_prefix(PACKAGE)).resolve()
    for found in (prefix, Path(adhesion_node.__file__).resolve()):
        if not found.is_relative_to(install):
            return fail(f"{found} is found, which is not in the workspace {install}")
    defaults = Path(get_package_share_directory(PACKAGE), "config", "defaults.yaml")
    if not defaults.is_file():
        return fail(f"{defaults} is missing")
    executable = prefix / "lib" / PACKAGE / "estimator"
    print(f"starting {executable}")
    # A new process finds its own ROS libraries: the marks of this one must not reach it.
    inherited = {"_ROS_WHEELS_BOOTSTRAP_COMPLETE", "LD_LIBRARY_PATH"}
    environment = {name: value for name, value in os.environ.items() if name not in inherited}
    process = subprocess.Popen([executable, "--ros-args", "-r", f"__ns:={NAMESPACE}"], env=environment)
    try:
        return check(process)
    finally:
        process.kill()
        process.wait()


def check(process: subprocess.Popen[bytes]) -> int:
    """Wait for the estimator's subscription, then ask it to stop."""
    rclpy.init()
    watcher = rclpy.create_node("ci_watcher")
    deadline = time.monotonic() + START_TIMEOUT_S
    while watcher.count_subscribers(TOPIC) == 0:
        if process.poll() is not None:
            return fail(f"the estimator ended at start with exit code {process.returncode}")
        if time.monotonic() > deadline:
            return fail(f"no subscription to {TOPIC} within {START_TIMEOUT_S:g} s")
        rclpy.spin_once(watcher, timeout_sec=0.1)
    print(f"the estimator is up: it listens to {TOPIC}")
    rclpy.try_shutdown()
    process.send_signal(signal.SIGINT)
    code = process.wait(STOP_TIMEOUT_S)
    if code != 0:
        return fail(f"the estimator ended with exit code {code} after SIGINT")
    print("the estimator ended with exit code 0 after SIGINT")
    return 0


def fail(message: str) -> int:
    """Say what is wrong; return the exit code."""
    print(message, file=sys.stderr)
    return 1


if __name__ == "__main__":
    sys.exit(main())
