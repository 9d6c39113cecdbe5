"""Taylor coefficients of the solution of a differential equation."""
