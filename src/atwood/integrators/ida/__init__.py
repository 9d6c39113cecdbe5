"""SUNDIALS IDA: driven natively over its shared libraries, and through scikit-sundae as the reference."""
