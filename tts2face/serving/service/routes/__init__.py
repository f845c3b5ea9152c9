"""HTTP and WebSocket routes of the service.

A new route:

1. a function in the module of its subject, with ``@router.post(...)`` and a summary; a new module has a ``router`` of
   its own, which `tts2face.serving.service.application.create_app` includes;
2. its fields are a model made by `clip_options.options_model` where they are options of clips, else a pydantic model;
3. `state.service_state` has what all share, ``request.state.key`` is the key, `access.require_scope` asks for a scope;
4. what is synthesised is a `Work` of `Results.work`, and `streams.stream_work` its answer, sent while it is made;
5. errors of `lexicon.errors` and `RefusedError` become answers by themselves.
"""
