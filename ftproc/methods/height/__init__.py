"""What is known of a target's height beside its elevation, or instead of it: heights that a log gives, and priors."""
