"""What can be observed: quantities by path, event functions, power, reactions inside bodies."""
