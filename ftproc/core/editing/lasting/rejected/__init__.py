"""The rejected runs of an edited log, weighed against what else they may be."""
