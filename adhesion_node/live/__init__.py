# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""The live page: what the nodes say, in a browser, while they run."""
