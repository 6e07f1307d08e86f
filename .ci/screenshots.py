# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""Renew the pictures of the pages and of the demo, in doc/pictures; those of the pages in a real browser.

live.png, report.png, tunnel_entry.png, changing.png, supervision.png. Usage: PYTHONPATH=.:test python
.ci/screenshots.py, with the extras `ros`, `live` and `test`, and with chromium. Takes three minutes: the live page is
that of `demo --live --scenario approach`, as the service brake comes.
"""

import shutil
import signal
import socket
import subprocess
import sys
import tempfile
from pathlib import Path

from browser import open_page

from adhesion_node.bag import BagReader
from adhesion_node.report.__main__ import main as report
from adhesion_node.report.run import read_run
from adhesion_node.study.__main__ import main as study
from adhesion_node.study.intervention.figure import draw_changing
from adhesion_node.tools.demo import main as demo
from sim_node.train.scenario import SCENARIOS

ROOT = Path(__file__).resolve().parent.parent
BAGS, PICTURES = ROOT / "bags", ROOT / "doc" / "pictures"
SHOWN = "SERVICE BRAKE"
"""Level at which the live page is photographed."""

PATIENCE_MS = 90_000.0
SPARE_M = 300.0
"""Way behind the place where the train is slow enough, to the target."""

DEMO = (
    "from adhesion_node.tools.demo import main; "
    "raise SystemExit(main(['--live', '--scenario', 'approach', '--port', '{}', '--output', r'{}']))"
)


def picture_live(folder: Path) -> None:
    """Photograph the live page of a demo, then stop the demo."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    shown = subprocess.Popen([sys.executable, "-c", DEMO.format(port, folder / "demo")], stderr=subprocess.PIPE)
    try:
        assert shown.stderr is not None
        shown.stderr.readline()  # "open http://...": it is served
        with open_page() as (page, _):
            page.set_viewport_size({"width": 1366, "height": 768})
            page.goto(f"http://127.0.0.1:{port}/")
            page.locator("#level").get_by_text(SHOWN).wait_for(timeout=PATIENCE_MS)
            page.screenshot(path=PICTURES / "live.png")
    finally:
        shown.send_signal(signal.SIGINT)
        shown.communicate()


def picture_report(folder: Path) -> None:
    """Photograph the head of a report on both reference recordings."""
    recordings = [str(BAGS / name) for name in ("tunnel_entry", "tunnel_exit")]
    report([*recordings, "--output", str(folder / "report"), "--target", "100"])
    with open_page() as (page, _):
        page.set_viewport_size({"width": 1250, "height": 1500})
        page.goto(f"{(folder / 'report' / 'report.html').as_uri()}#t=40")
        page.screenshot(path=PICTURES / "report.png")


def picture_rails(folder: Path) -> None:
    """Draw what the demo draws, the limits on a rail that changes, and those of the ATP monitor."""
    demo(["--output", str(folder / "entry")])
    shutil.copyfile(folder / "entry" / "run.png", PICTURES / "tunnel_entry.png")
    demo(["--scenario", "low_adhesion_patch", "--output", str(folder / "patch")])
    scenario = SCENARIOS["low_adhesion_patch"]
    with BagReader(folder / "patch" / "bag") as reader:
        run = read_run(reader)
    (_, from_m, to_m), end_m = (start_m for start_m, _ in scenario.rail.laws), float(run.true_position.values[-1])
    target = (end_m + SPARE_M, float(scenario.end_speed_mps or 0.0))
    draw_changing(run, scenario.rail, (from_m, to_m), target, PICTURES / "changing.png")
    study(["intervention", "--bags", str(BAGS), "--figures", str(PICTURES)])


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as name:
        picture_rails(Path(name))
        picture_report(Path(name))
        picture_live(Path(name))
