"""Arrays with names, units and dimensions, and the formats that they are kept in; runs and sweeps share them."""
