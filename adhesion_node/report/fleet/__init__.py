# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""The report of many brakings: the tables that the program `brakings` wrote, as one page."""
