"""The ROS 2 package around engb_core: nodes, bags and the `engb` command line."""
