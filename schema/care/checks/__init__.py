"""What can be wrong in a store: one question a file, each (connection, scope) -> findings."""
