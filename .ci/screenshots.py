# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Renew all pictures of doc/pictures, each under the name of its function; those of the pages in a real browser.

Usage: PYTHONPATH=.:test python .ci/screenshots.py [NAME ...], with the extras `ros`, `live` and `test`, and with
chromium. All take five minutes on two cores. The live page is that of `demo --live --scenario approach`, as the
service brake comes; that of a fleet shows the demos of trains with wheels as if they were of three days.
"""

import shutil
import signal
import socket
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import pandas as pd
from browser import open_page

from adhesion_node.bag import BagReader
from adhesion_node.bench.__main__ import main as bench
from adhesion_node.report.__main__ import main as report
from adhesion_node.report.read.recorded import read_run
from adhesion_node.study.__main__ import main as study
from adhesion_node.study.intervention.figure import draw_changing
from adhesion_node.study.trial.figures import Place
from adhesion_node.tools.brakings.__main__ import main as brakings
from adhesion_node.tools.demo.__main__ import main as demo
from sim_node.real import known
from sim_node.real.plant.scenarios import SCENARIOS
from sim_node.real.sensors.fitted import FITTED

ROOT = Path(__file__).resolve().parent.parent
BAGS, PICTURES = ROOT / "bags", ROOT / "doc" / "pictures"
SHOWN = ("WARNING", "EMERGENCY BRAKE")
"""Levels in their order, at the last of which the live page is photographed: it begins in an emergency, too."""

PATIENCE_MS = 90_000.0
SENSORS = "full"
"""What the trains with wheels are fitted with."""

LEAVES_M = 800.0
"""Where the leaves of `patch_fall` begin."""

FLEET = {"patches": "2026-11-09", "leaves": "2026-11-10", "patch_fall": "2026-11-11"}
"""Scenarios, and the days that they are shown as."""

DEMO = (
    "from adhesion_node.tools.demo.__main__ import main; "
    "raise SystemExit(main(['--live', '--scenario', 'approach', '--port', '{}', '--output', r'{}']))"
)


@cache
def folder() -> Path:
    """Folder for what the pictures are made from; it goes at the end."""
    return Path(tempfile.mkdtemp(prefix="screenshots"))


@cache
def demo_of(scenario: str, *options: str) -> Path:
    """Run a demo once; the folder that it leaves."""
    left = folder() / scenario
    demo(["--scenario", scenario, "--output", str(left), *options])
    return left


def real(scenario: str) -> Path:
    """Run the demo of a train with wheels once."""
    return demo_of(scenario, "--sensors", SENSORS, "--seed", "1")


def told(scenario: str) -> list[str]:
    """What such a train is told of itself, as options."""
    settings = known.parameters(SCENARIOS[scenario], FITTED[SENSORS])
    return [option for name, value in settings.items() for option in ("--set", f"{name}={value}")]


def photograph(page_at: str, name: str, height: int) -> None:
    """Photograph the head of a page that stands in a file."""
    with open_page(viewport={"width": 1250, "height": height}) as (page, _):
        page.goto(page_at)
        page.screenshot(path=PICTURES / f"{name}.png")


def tunnel_entry() -> None:
    """What the demo draws."""
    shutil.copyfile(demo_of("tunnel_entry") / "run.png", PICTURES / "tunnel_entry.png")


def leaves() -> None:
    """What the demo draws on leaves."""
    shutil.copyfile(real("leaves") / "run.png", PICTURES / "leaves.png")


def patches() -> None:
    """What the demo draws on patches."""
    shutil.copyfile(real("patches") / "run.png", PICTURES / "patches.png")


def changing() -> None:
    """The limits on a rail that changes."""
    with BagReader(real("patch_fall") / "bag") as reader:
        draw_changing(read_run(reader), LEAVES_M, Place(PICTURES / "changing.png"))


def supervision() -> None:
    """The limits of the ATP monitor."""
    study(["intervention", "--bags", str(BAGS), "--figures", str(PICTURES)])


def growth() -> None:
    """How the cost grows, on this machine."""
    bench(["growth", "--figures", str(PICTURES)])


def patch_fall() -> None:
    """The first run of a case of `study real`."""
    place = ["--figures", str(folder() / "real"), "--cache", str(folder() / "cache")]
    study(["real", "--only", "patch_fall", "--runs", "1", *place])
    shutil.copyfile(folder() / "real" / "patch_fall-gnss_doppler.png", PICTURES / "patch_fall.png")


def live() -> None:
    """The live page of a demo, which is then stopped."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    shown = subprocess.Popen([sys.executable, "-c", DEMO.format(port, folder() / "live")], stderr=subprocess.PIPE)
    try:
        assert shown.stderr is not None
        shown.stderr.readline()  # "open http://...": it is served
        with open_page(viewport={"width": 1366, "height": 768}) as (page, _):
            page.goto(f"http://127.0.0.1:{port}/")
            for level in SHOWN:
                page.locator("#level").get_by_text(level).wait_for(timeout=PATIENCE_MS)
            page.wait_for_timeout(3000)  # the charts follow
            page.screenshot(path=PICTURES / "live.png")
    finally:
        shown.send_signal(signal.SIGINT)
        shown.communicate()


def report_() -> None:
    """The head of a report on two recordings."""
    recordings = [folder() / "recordings" / name for name in ("patch_fall", "leaves")]
    for path in recordings:
        shutil.copytree(real(path.name) / "bag", path)
    report([*map(str, recordings), "--output", str(folder() / "report"), "--target", "50"])
    photograph(f"{(folder() / 'report' / 'report.html').as_uri()}#t=40", "report", 1800)


def fleet() -> None:
    """The report of many brakings."""
    tables: dict[str, list[pd.DataFrame]] = {"brakings": [], "rail": []}
    for name, day in FLEET.items():
        files = {table: folder() / f"{name}_{table}.parquet" for table in tables}
        outputs = ["--output", str(files["brakings"]), "--map", str(files["rail"]), "--cache", str(folder() / "cache")]
        brakings([f"unit_7={real(name) / 'bag'}", *outputs, *told(name)])
        for table, path in files.items():
            rows = pd.read_parquet(path)
            rows["t_ns"] += pd.Timestamp(day).value
            tables[table].append(rows.assign(date=day) if "date" in rows else rows)
    paths = [folder() / f"{table}.parquet" for table in tables]
    for path, parts in zip(paths, tables.values(), strict=True):
        pd.concat(parts).to_parquet(path, index=False)
    report([*map(str, paths), "--output", str(folder() / "fleet")])
    photograph((folder() / "fleet" / "report.html").as_uri(), "fleet", 1250)


PICTURED = (tunnel_entry, leaves, patches, changing, supervision, growth, patch_fall, report_, fleet, live)
"""Every picture."""


def main(names: Sequence[str]) -> None:
    """Renew the pictures of some names, or all."""
    try:
        for picture in PICTURED:
            if not names or picture.__name__.strip("_") in names:
                picture()
    finally:
        shutil.rmtree(folder())


if __name__ == "__main__":
    main(sys.argv[1:])
