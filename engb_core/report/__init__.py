# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Results as one self-contained page: neutral figures, a page layout, the diagnosis report."""
