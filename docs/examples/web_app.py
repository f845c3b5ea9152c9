"""A FastAPI application with a talking face: one `Session` for all requests, clips that are sent while they are made.

    pip install '.[service]'
    uvicorn web_app:app

http://localhost:8000 shows the page. The service of tts2face (docs/http.md) has keys, limits and jobs besides.
"""

from itertools import chain
from typing import Annotated

from fastapi import FastAPI, Query
from fastapi.responses import HTMLResponse, JSONResponse, StreamingResponse

import tts2face

PAGE = """<!doctype html><title>Talking face</title>
<form><input name="text" value="Hello there."> <button>Speak</button></form> <video autoplay controls></video>
<script>
document.querySelector("form").onsubmit = event => {
  event.preventDefault()
  document.querySelector("video").src = "/clip?" + new URLSearchParams(new FormData(event.target))
}
</script>"""

app = FastAPI()
session = tts2face.Session()  # its methods may be called from several threads
Text = Annotated[str, Query(min_length=1, max_length=500)]


@app.exception_handler(tts2face.InputError)
def refuse(_, error):
    return JSONResponse({"detail": str(error)}, 422)


@app.get("/", response_class=HTMLResponse)
def page():
    return PAGE


@app.get("/clip")
def clip(text: Text, style: str | None = None):
    chunks = session.stream_file(text, "mp4", style=style, size="384x384")
    first = next(chunks)  # a wrong request is refused here, before the answer begins
    return StreamingResponse((chunk.content for chunk in chain([first], chunks)), media_type="video/mp4")


@app.get("/words")
def words(text: Text):
    speech = session.clip(text).speech
    return [(word.text, *speech.phones.edges[[word.first, word.last]].tolist()) for word in speech.words]
