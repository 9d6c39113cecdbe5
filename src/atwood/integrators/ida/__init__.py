"""SUNDIALS IDA, driven over its shared libraries."""
