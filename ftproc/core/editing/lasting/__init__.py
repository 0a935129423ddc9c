"""Faults that last: patches of any length, steps that stay, clocks that jump; proposed, weighed, taken out; and the
reassessment of the runs that are rejected."""

from __future__ import annotations
