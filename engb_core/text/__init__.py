# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Text from outside and to outside: YAML that may be anything, words that any terminal takes."""
