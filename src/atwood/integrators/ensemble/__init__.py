"""Many runs of one smooth problem in one compiled call."""
