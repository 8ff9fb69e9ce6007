# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Nodes as processes of a program: started, listened to, driven, ended."""
