# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The reproduction's experiments on live nodes, with known brakes and with sealed ones."""
