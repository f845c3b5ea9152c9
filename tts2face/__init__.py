"""Text becomes a talking face."""

from pathlib import Path

from tts2face.kernel_cache import settle_kernel_cache

__version__ = "0.1.0"

settle_kernel_cache(Path(__file__).parent)
