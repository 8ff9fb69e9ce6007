# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A model taken along: as C, as an FMU, and in the formats of other simulators."""
