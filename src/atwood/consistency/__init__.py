"""The laws of a component against each other, on numbers: what contradicts itself is refused before it moves."""
