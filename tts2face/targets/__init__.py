"""Where a live face is sent: WebRTC, RTMP and RTSP servers, programs of avatars, a WebSocket, a window.

The next kind is a class below `tts2face.targets.target.Target` (or one of its two forms) in a file of its own, and a
row in `tts2face.targets.table`; addresses, states, reconnection and the command come from there.
"""
