"""Probes of VTK that do not draw."""

import os
import time

from tts2face.picture.vtk_renderer import OFF_SCREEN, PROBE

CRASHES = {PROBE: lambda call: os.abort()}
FAILS = {PROBE: lambda call: {"is_drawn": False}}
HANGS = {PROBE: lambda call: time.sleep(60)}
SEES = {PROBE: lambda call: {"is_drawn": call.content["window"] == OFF_SCREEN}}
