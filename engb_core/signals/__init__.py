# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""From samples to motion: filters, the band, faults of the data, errors of the position."""
