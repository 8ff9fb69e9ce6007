# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Identification of the brake's model from recordings (chapter 3 of the paper)."""
