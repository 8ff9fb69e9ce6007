"""The simulated test bench: a brake, its drive and its load cell, with more physics than a fit."""
