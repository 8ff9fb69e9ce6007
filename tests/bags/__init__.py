# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Tests of engb_core.io.bags."""
