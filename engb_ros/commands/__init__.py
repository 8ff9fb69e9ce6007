# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The `engb` program: main.py, and one file per command."""
