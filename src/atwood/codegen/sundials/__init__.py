"""Functions with the C signatures of SUNDIALS IDA, as machine code."""
