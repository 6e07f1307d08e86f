# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""`study safety`: the monitor against trains that need more way than they have left, whatever goes wrong."""
