# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""What the studies share: simulated runs as tasks, their scores and pictures."""
