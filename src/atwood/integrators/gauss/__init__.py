"""The implicit Runge-Kutta methods of Gauss with fixed steps, of orders 2 to 12, for Hamilton's equations."""
