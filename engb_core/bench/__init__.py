# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The simulated test bench: a brake, its drive and its load cell, with more physics than a fit."""
