# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Wrong numbers of the file, told from missing physics and from what a refit moved."""
