"""Effects: physics that a model may leave out, one file each."""
