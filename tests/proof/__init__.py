# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Sealed cases: a truth plant of its own making, and the scores of a diagnosis against it."""
