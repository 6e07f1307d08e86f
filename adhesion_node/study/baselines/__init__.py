# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""Estimators that the studies compare with."""
