"""Files of clients: checks, storage, names."""
