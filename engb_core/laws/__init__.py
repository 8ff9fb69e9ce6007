# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Laws: formulas of a restricted grammar for what no effect of the library explains."""
