"""Tests of engb_ros.bags."""
