"""From samples to motion: filters, the band, faults of the data, errors of the position."""
