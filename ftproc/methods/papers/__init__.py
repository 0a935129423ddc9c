"""The methods of the literature with which two-pass editing is compared, each from a paper of its own."""
