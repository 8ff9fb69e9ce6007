# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The one definition of each torque: plant, inverse dynamics, simulation, what is compiled."""
