"""Tools for the service and the studio, each run in a child process with limits and without a network.

They are handlers of `tts2face.processes` in the entry-point group ``tts2face.tools``.
"""
