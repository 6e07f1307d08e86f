# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""A train's own log, CSV or Parquet: how it is written, its rows in SI units, what is odd of it."""
