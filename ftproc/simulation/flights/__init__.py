"""The flights of the simulation, by the kind of what flies: each is a true motion with nothing measured yet."""
