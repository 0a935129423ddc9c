"""What the zoo does not show of formats of a standard: refusals, questions, damage, matrices and cells."""
