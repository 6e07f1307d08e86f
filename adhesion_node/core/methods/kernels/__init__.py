# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""The arithmetic of the methods as compiled loops over the steps of a window, or over its particles."""
