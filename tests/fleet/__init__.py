"""Tests of engb_ros.fleet and engb_core.fleet."""
