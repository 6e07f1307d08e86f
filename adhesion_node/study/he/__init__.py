# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""`study creep`: the experiments of He et al. 2017."""
