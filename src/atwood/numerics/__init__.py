"""Numbers alone, dense and sparse, for one state and for many; nothing here knows of mechanics.

`rank` decides ranks by singular values, with how far a matrix may be off, and gives null spaces; `independence` chooses
independent rows by propagated rounding; `solutions` are the shortest and the best; `newton` is the one Newton's method;
`matrices` are arrays or sparse, whichever is better. Of sparse elimination, `sparse` does that of one matrix,
`sparse_batch` that of many with one pattern, `fixed_pivots` that of the matrices of an implicit integrator.
"""
