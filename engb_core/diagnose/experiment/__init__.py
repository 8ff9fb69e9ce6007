# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Which recording would tell the causes apart that are left."""
