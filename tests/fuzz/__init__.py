"""Damaged input: `python tests/fuzz/run.py --count 10000`; a small part runs in pytest."""
