"""Clean trajectories, with honest uncertainties, from dirty theodolite and radar logs."""

__version__ = "0.1.0"
