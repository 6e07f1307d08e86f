# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""`study tables`, `distances` and `sensitivity`: the figures of Xie et al. 2019."""
