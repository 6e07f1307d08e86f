# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""What a recording shows: its series, and the page, the pictures and the table of them."""
