# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""What every program of the package has in common: options, exit codes, progress, signals, work on all cores."""
