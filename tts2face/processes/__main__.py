"""``python -m tts2face.processes PROGRAM``, started by `tts2face.processes.parent`: a child of one `Program`."""

import os
import sys

from lexicon.errors import BackendError
from tts2face.processes.child import bind_to_core, claim_standard_output, refusing, serve
from tts2face.processes.collection import pause_collection, resume_collection
from tts2face.processes.program import limit_process, read_program


def main() -> None:
    """Serve the handlers of a program within its limits."""
    pause_collection()
    out = claim_standard_output()
    program = read_program(sys.argv[1])
    bind_to_core(program.core)
    try:
        handlers = program.load()
    except BackendError as missing:
        handlers = refusing(missing)
    resume_collection()
    if program.limits is not None:
        limit_process(program.limits)
    os.nice(program.niceness)
    serve(handlers, out, program.at_once)


if __name__ == "__main__":
    main()
