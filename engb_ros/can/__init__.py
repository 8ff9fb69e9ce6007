"""The CAN side of the package: frames, their protection, and the link to a drive. No ROS."""
