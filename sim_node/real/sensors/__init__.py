# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""The sensors of a real train: what each shows of a journey, when, and when that arrives."""
