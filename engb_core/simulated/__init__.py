# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Somebody's simulator in place of a model file: recordings, FMUs and joints of robot formats."""
