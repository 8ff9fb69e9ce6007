"""Sealed cases: a truth plant of its own making, and the scores of a diagnosis against it."""
