# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""Speed: ours beside its peers, measured in one run."""
