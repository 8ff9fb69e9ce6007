"""Bags: `read.read_recording` and `write.write_bag`; needs no ROS installation."""
