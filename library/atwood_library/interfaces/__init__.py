"""What parts of the library have in common; nothing here is a part by itself."""
