# SPDX-License-Identifier: Apache-2.0
"""Who may see the page: this machine, and from elsewhere those who know the token."""

import hmac
from urllib.parse import parse_qs, urlsplit

HOME = ('localhost', '127.0.0.1', '::1')  # addresses that only this machine reaches
COOKIE = 'comply_ros_token'
LONGEST = 1000  # bytes of a form that are read
SHORTEST_TOKEN = 8  # characters
FORM = """<!doctype html><html lang="en"><meta charset="utf-8">
<meta name="viewport" content="width=device-width"><meta name="color-scheme" content="light dark">
<title>comply_ros</title><body style="font:16px system-ui;max-width:26rem;margin:15vh auto">
<h1 style="font-size:1.4rem">comply_ros</h1><form method="post" action="/">
<p><label for="token">Token, as the terminal of the dashboard shows it</label></p>
<input id="token" name="token" type="password" autofocus style="font:inherit;padding:.4rem">
<button style="font:inherit;padding:.4rem">Open</button><p role="alert">{}</p></form>"""


class AccessControl:
    """
    An ASGI application that lets nobody through to another who may not.

    Parameters
    ----------
    app: the other application.
    token: that a visitor must know; empty: none, but the page must be asked for by a name of
        this machine, and by no other site: a browser lets any site speak to localhost.

    """

    def __init__(self, app, token):
        self._app, self._token = app, token

    async def __call__(self, scope, receive, send):
        """Serve one request, or refuse it."""
        if scope['type'] == 'lifespan' or self._may_pass(scope):
            await self._app(scope, receive, send)
        elif scope['type'] == 'websocket':
            await receive()
            await send({'type': 'websocket.close', 'code': 1008})
        elif not self._token:
            await _answer(send, 403, 'The page must be opened by the address that the dashboard '
                          'printed, on the machine on which it runs.')
        else:
            await self._ask(scope, receive, send)

    def _may_pass(self, scope):
        try:
            return self._is_known(scope)
        except ValueError:  # a host or an origin that is none
            return False

    def _is_known(self, scope):
        headers = dict(scope['headers'])
        host, origin = (headers.get(name, b'').decode('latin-1') for name in (b'host', b'origin'))
        if origin and urlsplit(origin).netloc != host:
            return False
        if not self._token:
            return urlsplit(f'//{host}').hostname in HOME
        return self._is_right(_cookie(headers))

    def _is_right(self, token):
        return hmac.compare_digest(token.encode(), self._token.encode())

    async def _ask(self, scope, receive, send):
        """Let in who brings the right token, in the address or in the form; else show the form."""
        given = scope['query_string'] if scope['method'] != 'POST' else await _body(receive)
        token = parse_qs(given.decode('latin-1')).get('token', [''])[0]
        if self._is_right(token):
            cookie = f'{COOKIE}={self._token}; Path=/; HttpOnly; SameSite=Lax'
            await _answer(send, 303, '', (b'location', b'/'), (b'set-cookie', cookie.encode()))
        else:
            await _answer(send, 401, FORM.format('This is not the token.' if token else ''))


def _cookie(headers):
    pairs = (each.strip().partition('=')
             for each in headers.get(b'cookie', b'').decode('latin-1').split(';'))
    return next((value for name, _, value in pairs if name == COOKIE), '')


async def _body(receive):
    body, more = b'', True
    while more and len(body) < LONGEST:
        message = await receive()
        body, more = body + message.get('body', b''), message.get('more_body', False)
    return body[:LONGEST]


async def _answer(send, code, text, *headers):
    await send({'type': 'http.response.start', 'status': code, 'headers': [
        (b'content-type', b'text/html; charset=utf-8'), (b'cache-control', b'no-store'),
        *headers]})
    await send({'type': 'http.response.body', 'body': text.encode()})
