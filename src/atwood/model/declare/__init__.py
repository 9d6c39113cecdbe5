"""What a component declares: parameters, connectors, laws."""
