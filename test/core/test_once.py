# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What belongs to settings is made once for each of them, told by identity."""

from __future__ import annotations

from adhesion_node.core.config import Config
from adhesion_node.core.setting import MOST_KEPT, once


def test_what_belongs_to_settings_is_made_once() -> None:
    asked: list[str] = []

    @once
    def law_of(config: Config) -> str:
        asked.append(config.law)
        return config.law

    wet, dry = Config(), Config(law="dry")
    assert [law_of(each) for each in (wet, dry, wet, dry)] == ["wet", "dry", "wet", "dry"]
    assert asked == ["wet", "dry"]
    for _ in range(2 * MOST_KEPT):  # others come and go: what is kept is bounded, and none is taken for another
        assert law_of(Config(law="snow")) == "snow"
    assert law_of(wet) == "wet"
