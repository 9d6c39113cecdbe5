"""How neighbouring motions move: tangent flow, Lyapunov exponents, Poincare sections."""
