# SPDX-License-Identifier: Apache-2.0
"""Who may see the page: users of this machine, and from elsewhere those who know the token."""

from collections.abc import Callable
import hmac
from typing import Any
from urllib.parse import parse_qs, urlsplit

LOCAL_HOSTS = ('localhost', '127.0.0.1', '::1')  # addresses that only this machine reaches
COOKIE = 'comply_ros_token'
MAX_FORM_SIZE = 1000  # bytes that are read
MIN_TOKEN_LENGTH = 8
FORM = """<!doctype html><html lang="en"><meta charset="utf-8">
<meta name="viewport" content="width=device-width"><meta name="color-scheme" content="light dark">
<title>comply_ros</title>
<body style="font:16px system-ui;max-width:26rem;margin:15vh auto;padding:0 1rem">
<h1 style="font-size:1.4rem">comply_ros</h1><form method="post" action="/">
<p><label for="token">Token, as the dashboard has printed it in its terminal</label></p>
<input id="token" name="token" type="password" autofocus style="font:inherit;padding:.4rem">
<button style="font:inherit;padding:.4rem">Open</button><p role="alert">{}</p></form>"""


class AccessControl:
    """
    An ASGI application that passes on the requests of those who know the token.

    With an empty token, requests must be to a name of this machine, and not come from another
    site: browsers let any site call localhost.
    """

    def __init__(self, app: Callable, token: str) -> None:
        self._app, self._token = app, token

    async def __call__(self, scope: dict[str, Any], receive: Callable, send: Callable) -> None:
        """Answer one request, or reject it."""
        if scope['type'] == 'lifespan' or self._is_allowed(scope):
            await self._app(scope, receive, send)
        elif scope['type'] == 'websocket':
            await receive()
            await send({'type': 'websocket.close', 'code': 1008})
        elif not self._token:
            await _respond(send, 403, 'Open the page by the address that the dashboard has '
                           'printed, on the machine on which it runs.')
        else:
            await self._ask_for_token(scope, receive, send)

    def _is_allowed(self, scope: dict[str, Any]) -> bool:
        headers = dict(scope['headers'])
        host, origin = (headers.get(name, b'').decode('latin-1') for name in (b'host', b'origin'))
        try:
            if origin and urlsplit(origin).netloc != host:
                return False
            if not self._token:
                return urlsplit(f'//{host}').hostname in LOCAL_HOSTS
        except ValueError:  # this host or origin cannot be one
            return False
        pairs = (each.strip().partition('=')
                 for each in headers.get(b'cookie', b'').decode('latin-1').split(';'))
        return self._is_right(next((value for name, _, value in pairs if name == COOKIE), ''))

    def _is_right(self, token: str) -> bool:
        return hmac.compare_digest(token.encode(), self._token.encode())

    async def _ask_for_token(self, scope: dict[str, Any], receive: Callable,
                             send: Callable) -> None:
        """Set the cookie if the address or the form holds the right token; else show the form."""
        given = scope['query_string'] if scope['method'] != 'POST' else await _body(receive)
        token = parse_qs(given.decode('latin-1')).get('token', [''])[0]
        if self._is_right(token):
            cookie = f'{COOKIE}={self._token}; Path=/; HttpOnly; SameSite=Lax'
            await _respond(send, 303, '', (b'location', b'/'), (b'set-cookie', cookie.encode()))
        else:
            await _respond(send, 401, FORM.format('This is not the token.' if token else ''))


async def _body(receive: Callable) -> bytes:
    body, more = b'', True
    while more and len(body) < MAX_FORM_SIZE:
        message = await receive()
        body, more = body + message.get('body', b''), message.get('more_body', False)
    return body[:MAX_FORM_SIZE]


async def _respond(send: Callable, code: int, text: str, *headers: tuple[bytes, bytes]) -> None:
    await send({'type': 'http.response.start', 'status': code, 'headers': [
        (b'content-type', b'text/html; charset=utf-8'), (b'cache-control', b'no-store'),
        *headers]})
    await send({'type': 'http.response.body', 'body': text.encode()})
