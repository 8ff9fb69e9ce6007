# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Reading and writing of files: recordings of every format, and outputs that destroy nothing.

`bags` holds rosbag2's formats (MCAP, SQLite) and needs no ROS, `tables` what other benches write.
`engb_core.read` takes either. Nothing in here knows physics, and no physics knows of files.
"""
