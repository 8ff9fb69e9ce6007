# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Bags: `read.read_recording` and `write.write_bag`; needs no ROS installation."""
