"""Tests of engb_ros.commands."""
