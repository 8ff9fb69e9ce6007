# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What many diagnoses say together: common causes, differences between units, trends."""
