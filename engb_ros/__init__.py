# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The ROS 2 package around engb_core: nodes, bags and the `engb` command line."""
