# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What no name explains: a flexible table, and how much of a mismatch it holds."""
