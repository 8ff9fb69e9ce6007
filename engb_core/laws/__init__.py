"""Laws: formulas of a restricted grammar for what no effect of the library explains."""
