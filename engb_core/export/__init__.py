"""A model taken along: as C, as an FMU, and in the formats of other simulators."""
