"""Tables of other people's benches, in the formats of the field, made into recordings."""
