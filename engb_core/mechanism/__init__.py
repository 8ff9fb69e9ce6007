# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Kinematics and statics of the brake, equations (2) to (24)."""
