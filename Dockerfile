# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
# ROS 2 Jazzy with this package, built and tested: docker build -t engb_ros .
FROM ros:jazzy

SHELL ["/bin/bash", "-c"]
ENV DEBIAN_FRONTEND=noninteractive

# Debian packages of the needs that have one; only cantools and rosbags come from PyPI.
# Not pinned (hadolint DL3008): ROS's apt repository keeps the newest version of a package only.
# hadolint ignore=DL3008
RUN apt-get update && apt-get install -y --no-install-recommends python3-venv python3-pip \
    python3-colcon-common-extensions && rm -rf /var/lib/apt/lists/*

# Ubuntu's Python is externally managed: what PyPI alone has goes into a venv that sees the system's
# packages, rclpy among them. colcon runs in it, so the nodes' first line names its Python.
RUN python3 -m venv --system-site-packages /opt/engb
ENV PATH=/opt/engb/bin:$PATH
RUN pip install --no-cache-dir 'rosbags>=0.11,<0.12' 'cantools>=39' 'python-can>=4.3' 'mcap>=1.1'

WORKDIR /ws
COPY . src/engb_ros
RUN . /opt/ros/jazzy/setup.bash && apt-get update && rosdep update --rosdistro jazzy \
    && rosdep install -y --from-paths src --ignore-src --rosdistro jazzy \
       --skip-keys 'python3-rosbags-pip python3-cantools-pip' \
    && rm -rf /var/lib/apt/lists/*
RUN . /opt/ros/jazzy/setup.bash && python -m colcon build --packages-select engb_ros

# What it says about itself, as a first check: the nodes start, the command line answers.
RUN . install/setup.bash && ros2 run engb_ros engb --help > /dev/null
ENTRYPOINT ["/bin/bash", "-c", ". /ws/install/setup.bash && exec \"$@\"", "--"]
CMD ["ros2", "launch", "engb_ros", "one_wheel.launch.xml"]
