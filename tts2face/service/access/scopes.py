"""What a key may do."""

from fastapi import Request as HttpRequest

from tts2face.service.access.keys import ApiKey
from tts2face.service.errors import RefusedError


def require_scope(request: HttpRequest, scope: str, what: str) -> ApiKey:
    """Key of a request, which must have a scope; `what` names in the plural what needs it.

    Raises
    ------
    RefusedError
        The key does not have the scope.
    """
    key: ApiKey = request.state.key
    if scope not in key.scopes:
        raise RefusedError(403, "forbidden", f"{what} need a key with the scope {scope}; this one has none such")
    return key
