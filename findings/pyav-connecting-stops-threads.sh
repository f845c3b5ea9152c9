#!/usr/bin/env bash
# PyAV 18.1.0 (FFmpeg 8): while `start_encoding` of an RTMP output waits for the server's answer, no other thread of the
# process runs: it keeps the interpreter's lock, and `timeout=1` of `av.open` is not heeded meanwhile. Here the server
# closes after 3 s, and the other thread has run in none of them. So neither an event loop nor a watchdog of the same
# process acts while a server is slow: connect in a process of its own. `mux` of the same library releases the lock.
# Fails (exit code 1) if the package behaves otherwise. Needs Python 3.11 to 3.14, pip and a package index.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

python3 -m venv "$work/environment"
"$work/environment/bin/pip" install --quiet --only-binary=:all: av==18.1.0 numpy
cat > "$work/server.py" <<'END'
import socket
import time

with socket.create_server(("127.0.0.1", 0)) as server:
    print(server.getsockname()[1], flush=True)
    with server.accept()[0]:
        time.sleep(3.0)
END
cat > "$work/run.py" <<'END'
import subprocess
import sys
import threading
import time

import av

ticks = []


def tick():
    while True:
        ticks.append(time.monotonic())
        time.sleep(0.05)


print("av", av.__version__)
server = subprocess.Popen([sys.executable, sys.argv[1]], stdout=subprocess.PIPE, text=True)
address = f"rtmp://127.0.0.1:{int(server.stdout.readline())}/live/key"
threading.Thread(target=tick, daemon=True).start()
time.sleep(1.0)
before = len(ticks)
container = av.open(address, "w", format="flv", timeout=1.0)
stream = container.add_stream("libx264", rate=25)
stream.width = stream.height = 64
began = time.monotonic()
try:
    container.start_encoding()
except OSError as error:  # the server has closed
    print("refused:", type(error).__name__)
seconds = time.monotonic() - began
during = sum(began + 0.1 < at < began + seconds - 0.1 for at in ticks)
print(f"another thread: {before} ticks in the second before, {during} in {seconds:.0f} s of connecting")
server.wait()
if before < 10 or during > 2 or seconds < 2.0:
    sys.exit("changed")
END
"$work/environment/bin/python" "$work/run.py" "$work/server.py"
echo "as described"
