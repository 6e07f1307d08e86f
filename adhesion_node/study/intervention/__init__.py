# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""`study intervention`: where a train is braked by what is identified."""
