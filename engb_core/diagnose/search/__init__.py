# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Which fits are made: every effect alone, with companions, from where it may start."""
