"""The science of engb_ros: brake model, identification, diagnosis. Knows no ROS."""
