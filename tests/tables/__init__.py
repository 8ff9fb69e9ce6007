"""Tests of engb_ros.tables."""
