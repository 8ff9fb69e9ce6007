# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The CAN side of the package: frames, their protection, and the link to a drive. No ROS."""
