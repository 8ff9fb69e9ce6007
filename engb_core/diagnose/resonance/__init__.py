# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A shaft that resonates: looked for in a wide band of its own."""
