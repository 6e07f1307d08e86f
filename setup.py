# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Packaging of adhesion_node for pip and for colcon (ament_python)."""

from pathlib import Path
from xml.etree import ElementTree

from setuptools import find_packages, setup

NAME = "adhesion_node"
HERE = Path(__file__).parent
MANIFEST = ElementTree.parse(HERE / "package.xml")

PROGRAMS = (
    *("estimator", "creep_estimator", "atp_monitor", "recorder", "replay", "live", "simulator", "slip_simulator"),
    *("import_csv", "train", "brakings", "recover", "demo", "report", "study", "bench"),
)

# Recordings, frames, pictures, geographic positions, completion in the shell. The nodes of a train run without.
# pandas, not polars: it is apt's, half as large, and reads the times and zones of recorders; of the import of a day
# (360 000 rows, 44 s) reading takes 0.6 s by it, 0.1 s by polars, and took 3.4 s by a reader of our own.
TOOLS = [
    "mcap>=1.5,<2",
    "zstandard>=0.22,<1",
    "lz4>=4,<5",
    "rosbags>=0.11.6,<0.12",
    "matplotlib>=3.6,<4",
    "pyproj>=3.4,<4",
    "argcomplete>=3,<4",
    "pandas>=2.1,<4",
]

# Tables as Parquet: small files with types, which pandas, Spark and DuckDB read alike. Only where one is asked for.
PARQUET = ["pyarrow>=15,<30"]

# The studies on a Dask cluster. Its versions are those of the calendar.
CLUSTER = ["distributed>=2024.8,<2027"]


def shared_files() -> list[tuple[str, list[str]]]:
    """List what goes under share/: marker, manifest, parameters, layouts, launch files and recordings."""
    share = Path("share", NAME)
    files = [
        (Path("share/ament_index/resource_index/packages"), f"resource/{NAME}"),
        (share, "package.xml"),
        (share / "config", "adhesion_node/nodes/defaults.yaml"),
        (share / "config", "launch/analyzers.yaml"),
        (share / "layouts", "adhesion_node/layouts/foxglove.json"),
        (share / "layouts", "adhesion_node/layouts/plotjuggler.xml"),
    ]
    files += [(share / "launch", str(path.relative_to(HERE))) for path in sorted((HERE / "launch").glob("*.launch.*"))]
    recordings = [path.relative_to(HERE) for path in sorted(HERE.glob("bags/**/*")) if path.is_file()]
    files += [(share / path.parent, str(path)) for path in recordings]
    return [(str(folder), [file]) for folder, file in files if (HERE / file).exists()]


setup(
    name=NAME,
    version="0.1.0",  # a literal, as the tools of a release replace it; a test holds it equal to that of package.xml
    description=MANIFEST.findtext("description"),
    maintainer=MANIFEST.findtext("maintainer"),
    maintainer_email=MANIFEST.find("maintainer").get("email"),
    license=MANIFEST.findtext("license"),
    packages=find_packages(include=["adhesion_node*", "sim_node*"]),
    package_data={
        "adhesion_node": ["py.typed", "nodes/*.yaml", "trains/*.yaml", "web/*", "layouts/*"],
        "sim_node": ["py.typed"],
    },
    data_files=shared_files(),
    zip_safe=False,
    python_requires=">=3.11",
    # numba: compiles the inner loops where they run, so that no compiler is needed to install. 0.58 is that of Ubuntu
    # 24.04, mended there for its Python 3.12; PyPI has 0.59 and later for 3.12, 0.61 and later for 3.13.
    # pyyaml: parameter files; rclpy itself has it from the distribution.
    install_requires=["numpy>=1.26,<3", "scipy>=1.11,<2", "numba>=0.58,<1", "pyyaml>=6,<7"],
    extras_require={
        # ROS 2 itself where no ROS 2 is sourced. The distribution names `rclpy` and `*_msgs` are not on PyPI.
        "ros": ["ros-jazzy-rclpy[fastrtps]==7.1.6", "ros-jazzy-common-interfaces==5.3.6"],
        "tools": TOOLS,
        "live": ["aiohttp>=3.9,<4"],
        "parquet": PARQUET,
        "cluster": CLUSTER,
        "test": [
            "pytest>=7.4,<10",
            "pytest-xdist>=3.5,<4",
            "hypothesis>=6.98,<7",
            "mcap-ros2-support>=0.5.5,<1",
            "playwright>=1.48,<2",
            "axe-playwright-python>=0.1.4,<0.2",
            *TOOLS,
            *CLUSTER,
            *PARQUET,
        ],
        "lint": ["ruff~=0.17.5", "mypy~=2.4", "import-linter~=2.16", "types-PyYAML>=6,<7"],
        # How well the tests hold: mutants and branches. Cosmic Ray, not mutmut: it changes constants of modules, too.
        "mutation": ["cosmic-ray>=8.4,<9", "pytest-cov>=5,<8"],
        "docs": ["rosdoc2>=0.2.1,<0.3"],
        # What `bench` measures against; particles wants numpy below 2, which has wheels up to Python 3.12.
        "bench": ["filterpy>=1.4.5,<3", "particles>=0.4,<0.5", "threadpoolctl>=3.2,<4", "gtsam>=4.2,<5"],
        # colcon drives `setup.py develop`, which setuptools 80 removed.
        "build": ["colcon-ros>=0.5,<1", "colcon-bash>=0.5,<1", "setuptools<80"],
    },
    entry_points={"console_scripts": [f"{name} = adhesion_node.main:{name}" for name in PROGRAMS]},
)
