# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Many recordings: found, diagnosed by processes or on a Dask cluster, kept to resume from."""
