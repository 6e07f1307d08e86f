# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""Train, rail and sensors as one belief, under many hypotheses at once, which the evidence weighs."""

BANK = "bank"
SUMMARY = "train, rail and sensors as one belief under many hypotheses, which the evidence weighs"
