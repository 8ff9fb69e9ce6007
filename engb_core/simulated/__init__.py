"""Somebody's simulator in place of a model file: recordings, FMUs and joints of robot formats."""
