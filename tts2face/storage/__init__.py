"""File access: atomic writes, output names, protection of inputs, and checks of model files."""
