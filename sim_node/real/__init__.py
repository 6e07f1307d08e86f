# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""Trains as they are: the second plant, with its own wheels, rail and slide protection."""
