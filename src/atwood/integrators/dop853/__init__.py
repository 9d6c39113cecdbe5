"""The explicit Runge-Kutta pair of order 8(5,3) of Dormand and Prince."""
