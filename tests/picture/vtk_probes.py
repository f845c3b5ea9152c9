"""Probes of VTK that do not draw, and one that draws off screen."""

import os
import time

import numpy as np

from tts2face.picture.display import OFF_SCREEN_CLASSES, PROBE

CRASHES = {PROBE: lambda call: os.abort()}
FAILS = {PROBE: lambda call: {"is_drawn": False}}
HANGS = {PROBE: lambda call: time.sleep(60)}
SEES = {PROBE: lambda call: {"is_drawn": True}}


def _draw_off_screen(call):
    os.environ["VTK_DEFAULT_OPENGL_WINDOW"] = OFF_SCREEN_CLASSES[0]
    import pyvista

    plotter = pyvista.Plotter(off_screen=True, window_size=(32, 32))
    plotter.add_mesh(pyvista.Sphere(), color="red", lighting=False)
    plotter.show(auto_close=False, interactive=False)
    return {"is_drawn": int(np.asarray(plotter.screenshot(return_img=True))[16, 16, 0]) > 200}


OFF_SCREEN = {PROBE: _draw_off_screen}
