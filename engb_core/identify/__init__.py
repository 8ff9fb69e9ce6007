"""Identification of the brake's model from recordings (chapter 3 of the paper)."""
