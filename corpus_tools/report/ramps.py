"""Colours for figures: a number becomes a colour that reads on light and on dark paper and in grey."""

from dataclasses import dataclass

import numpy as np

Colour = tuple[int, int, int]  # sRGB, 0 to 255


@dataclass(frozen=True, slots=True)
class Ramp:
    """Colours evenly over `low` to `high`; numbers beyond take the colour at the end."""

    low: float
    high: float
    stops: tuple[Colour, ...]

    def colour(self, value: float) -> Colour:
        """The colour of a number, straight between the stops."""
        part = (value - self.low) / (self.high - self.low) * (len(self.stops) - 1)
        places = np.arange(len(self.stops))
        red, green, blue = (round(float(np.interp(part, places, channel))) for channel in zip(*self.stops, strict=True))
        return red, green, blue

    def hexadecimal(self, value: float) -> str:
        """The same as ``#rrggbb``."""
        return "#{:02x}{:02x}{:02x}".format(*self.colour(value))


# Lightness rises evenly, so that the figure also reads in grey and without telling red from green.
LIKENESS = ((24, 22, 66), (38, 74, 122), (34, 128, 140), (110, 178, 122), (203, 213, 108), (255, 245, 190))
DIFFERENCE = ((13, 88, 166), (110, 164, 214), (238, 238, 236), (232, 160, 92), (166, 74, 8))


def likeness_ramp() -> Ramp:
    """Dark blue at 0, pale yellow at 1."""
    return Ramp(0.0, 1.0, LIKENESS)


def difference_ramp(largest: float) -> Ramp:
    """Blue below 0, grey at 0, orange above; `largest` is the number at either end."""
    return Ramp(-largest, largest, DIFFERENCE)
