"""The `engb` program: main.py, and one file per command."""
