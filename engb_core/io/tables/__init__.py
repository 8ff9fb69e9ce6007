# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Tables of other people's benches, in the formats of the field, made into recordings."""
