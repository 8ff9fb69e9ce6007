# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""How a hypothesis is fitted: starts by linear least squares, damped steps, multistart."""
