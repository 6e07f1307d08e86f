# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""Take the pictures of the pages, doc/pictures/live.png and report.png, in a real browser.

Usage: PYTHONPATH=.:test python .ci/screenshots.py, with the extras `ros`, `live` and `test`, and with chromium. Takes
about a minute: the live page is that of `demo --live`, 45 s after its start.
"""

import signal
import socket
import subprocess
import sys
import tempfile
from pathlib import Path

from browser import open_page

from adhesion_node.report.__main__ import main as report

ROOT = Path(__file__).resolve().parent.parent
BAGS, PICTURES = ROOT / "bags", ROOT / "doc" / "pictures"
SHOWN_AT = "45 s"
PATIENCE_MS = 90_000.0
DEMO = (
    "from adhesion_node.tools.demo import main; raise SystemExit(main(['--live', '--port', '{}', '--output', r'{}']))"
)


def picture_live(folder: Path) -> None:
    """Photograph the live page of a demo, then stop the demo."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    demo = subprocess.Popen([sys.executable, "-c", DEMO.format(port, folder / "demo")], stderr=subprocess.PIPE)
    try:
        assert demo.stderr is not None
        demo.stderr.readline()  # "open http://...": it is served
        with open_page() as (page, _):
            page.set_viewport_size({"width": 1250, "height": 985})
            page.goto(f"http://127.0.0.1:{port}/")
            page.locator("#state").get_by_text(SHOWN_AT, exact=True).wait_for(timeout=PATIENCE_MS)
            page.screenshot(path=PICTURES / "live.png")
    finally:
        demo.send_signal(signal.SIGINT)
        demo.communicate()


def picture_report(folder: Path) -> None:
    """Photograph the head of a report on both reference recordings."""
    recordings = [str(BAGS / name) for name in ("tunnel_entry", "tunnel_exit")]
    report([*recordings, "--output", str(folder / "report"), "--target", "100"])
    with open_page() as (page, _):
        page.set_viewport_size({"width": 1250, "height": 1350})
        page.goto(f"{(folder / 'report' / 'report.html').as_uri()}#t=40")
        page.screenshot(path=PICTURES / "report.png")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as name:
        picture_report(Path(name))
        picture_live(Path(name))
