"""Results as one self-contained page: neutral figures, a page layout, the diagnosis report."""
