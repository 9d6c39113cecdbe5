"""Numbers alone, dense and sparse, for one state and for many; nothing here knows of mechanics.

`rank` decides ranks and independent rows by how far a matrix may be off, and gives null spaces; `newton` is the one
Newton's method; `matrices` are arrays or sparse, whichever is better, with solutions that are shortest or best. Of
sparse elimination, `sparse` does that of one matrix, `sparse_batch` that of many with one pattern, `fixed_pivots` that
of the matrices of an implicit integrator.
"""
