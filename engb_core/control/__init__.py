# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The controller's parts: trajectory, PID, feedforward, disturbance observer, and their loop."""
