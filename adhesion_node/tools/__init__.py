# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""The command line tools: import a log, recover a recording, the demo."""
