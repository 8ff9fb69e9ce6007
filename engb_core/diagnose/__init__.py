"""From recordings and a model to a named, sized and checked mismatch."""
