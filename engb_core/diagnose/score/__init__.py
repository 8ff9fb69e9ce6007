# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""How fits compare: what they leave, what they are ranked by, how likely each is."""
