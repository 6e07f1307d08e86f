# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Writes the generated parts of the documentation: tables of parameters, topics and faults, and of what was measured.

    python doc/generate.py                    # every part, between its marks in README.md and doc/*.md
    python doc/generate.py --check            # name the pages that would change; exit code 1 where one would
    python doc/generate.py --measure robust   # run that study again first

A part stands between `<!-- generated: NAME -->` and `<!-- end -->`. Parameters, topics, faults and
constants come from the code; what was measured comes from doc/evidence/*.json, the JSON of the commands in
doc/evidence/made_by.json.
"""

import argparse
import re
import shlex
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

import bank_tables
import evidence_tables
import interface_tables

PAGES = Path(__file__).resolve().parent
README = PAGES.parent / "README.md"
PART = re.compile(r"(?<=<!-- generated: )(?P<name>.+?) -->\n.*?(?=<!-- end -->)", re.DOTALL)


def written(text: str, parts: Mapping[str, str]) -> str:
    """Return a page with its generated parts as they should be. Raises KeyError for a part that there is not."""
    return PART.sub(lambda part: f"{part['name']} -->\n\n{parts[part['name']]}\n\n", text)


def changed() -> Iterator[tuple[Path, str]]:
    """Yield the pages that are not as they should be, with what they should be."""
    parts = {**interface_tables.parts(), **bank_tables.parts(), **evidence_tables.parts()}
    for page in (README, *sorted(PAGES.glob("*.md"))):
        text = page.read_text(encoding="utf-8")
        wanted = written(text, parts)
        if wanted != text:
            yield page, wanted


def measure(name: str) -> None:
    """Run the command behind an evidence file again and keep its JSON."""
    from adhesion_node.study.__main__ import main as study

    program, *options = shlex.split(evidence_tables.MADE_BY[name]["command"])
    if program != "study" or study([*options, "--json", str(evidence_tables.FOLDER / f"{name}.json")]) != 0:
        raise SystemExit(f"{name}: {evidence_tables.MADE_BY[name]['command']}: failed")


def main() -> int:
    """Write the pages, or check them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="write nothing; exit code 1 where a page would change")
    measured = [name for name in evidence_tables.MADE_BY if not name.endswith("_before")]  # code that is gone
    parser.add_argument("--measure", action="append", default=[], choices=measured)
    options = parser.parse_args()
    for name in options.measure:
        measure(name)
    found = list(changed())
    for page, text in found:
        print(f"{page.name}: {'is not what doc/generate.py writes' if options.check else 'written'}")
        if not options.check:
            page.write_text(text, encoding="utf-8")
    return 1 if options.check and found else 0


if __name__ == "__main__":
    sys.exit(main())
