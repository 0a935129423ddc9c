"""The newest part of a window: which understanding of its readings holds."""
