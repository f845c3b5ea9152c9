"""Text becomes a talking face."""

__version__ = "0.1.0"
