# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Damaged input: `python tests/fuzz/run.py --count 10000`; a small part runs in pytest."""
