"""Numbers alone, dense and sparse, for one state and for many; nothing here knows of mechanics.

`rank` decides ranks by singular values, with how far a matrix may be off, and gives null spaces; `independence` chooses
independent rows with propagated rounding; `solutions` are the shortest and the best; `newton` is the one Newton's method;
`matrices` are arrays or sparse, whichever is better. Sparse elimination: `sparse` of one matrix, `sparse_batch` of many with
one pattern, `fixed_pivots` of those of an implicit integrator.
"""
