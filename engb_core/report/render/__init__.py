# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What draws the pictures of a report, which `engb_core.report.figures` holds as data."""
