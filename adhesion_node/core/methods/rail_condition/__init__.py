# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""A factor on the speed law, by a Gaussian smoother in a window."""
