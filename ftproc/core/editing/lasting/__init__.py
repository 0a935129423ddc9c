"""Faults that last: patches of any length, steps that stay, clocks that jump; proposed, weighed, taken out."""

from __future__ import annotations
