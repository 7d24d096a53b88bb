# SPDX-License-Identifier: Apache-2.0
"""Who may see the page: users of this machine, and from elsewhere those who know the token."""

from collections.abc import Callable
import hmac
from math import ceil
import secrets
from typing import Any
from urllib.parse import parse_qs, urlsplit

from comply_ros.dashboard.request_rate import (
    FREE_GUESSES,
    RateLimit,
    RequestRate,
    SECONDS_PER_GUESS,
)

LOCAL_HOSTS = ('localhost', '127.0.0.1', '::1')  # addresses that only this machine reaches
COOKIE = 'comply_ros'
MAX_FORM_SIZE = 1000  # bytes that are read
MIN_TOKEN_LENGTH = 8
OWN_SITE = ('', 'same-origin', 'none')  # of Sec-Fetch-Site: from the page, or typed by a person
# The page's library compiles templates, and has scripts and styles in the page.
POLICY = ("default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval'; "
          "style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; font-src 'self' data:; "
          "object-src 'none'; base-uri 'none'; form-action 'self'; frame-ancestors 'none'")
SECURITY_HEADERS = ((b'content-security-policy', POLICY.encode()),
                    (b'x-frame-options', b'DENY'), (b'x-content-type-options', b'nosniff'),
                    (b'referrer-policy', b'same-origin'),
                    (b'cross-origin-resource-policy', b'same-origin'))
FRAME = """<!doctype html><html lang="en"><meta charset="utf-8">
<meta name="viewport" content="width=device-width"><meta name="color-scheme" content="light dark">
<title>comply_ros</title>
<body style="font:16px system-ui;max-width:26rem;margin:15vh auto;padding:0 1rem">
<h1 style="font-size:1.4rem">comply_ros</h1>{}"""
FORM = FRAME.format("""<form method="post">
<p><label for="token">Token of the dashboard: it is in its terminal, or in its token_file</label>
</p><input id="token" name="token" type="password" autofocus style="font:inherit;padding:.4rem">
<button style="font:inherit;padding:.4rem">Open</button><p role="alert">{}</p></form>""")
LOCAL_ONLY = FRAME.format('<p>Open the page by the address that the dashboard has printed, on the '
                          'machine on which it runs.')
OTHER_SITE = FRAME.format('<p>Another site has sent you here.<p><a href="?">Open the page</a>')
TOO_MANY = FRAME.format('<meta http-equiv="refresh" content="5"><p>Your address sends too many '
                        'requests: this page tries again.')


class AccessControl:
    """
    An ASGI application that passes on the requests of those who know the token.

    With an empty token, requests must be to a name of this machine. No request may come from
    another site: browsers let any site call localhost. Those who send too many have to wait.

    log: called with a sentence about a wrong token.
    rate: of the requests of each address; by default as `request_rate` has it.
    """

    def __init__(self, app: Callable, token: str, log: Callable[[str], Any] = lambda text: None,
                 rate: RequestRate | None = None) -> None:
        self._app, self._token, self._log = app, token, log
        self._session, self._rate = secrets.token_urlsafe(32), rate or RequestRate()
        self._guesses = RateLimit(FREE_GUESSES, SECONDS_PER_GUESS)

    async def __call__(self, scope: dict[str, Any], receive: Callable, send: Callable) -> None:
        """Answer one request, or reject it."""
        if scope['type'] == 'lifespan':
            await self._app(scope, receive, send)
        elif scope['type'] == 'websocket':
            if self._is_own_site(scope) and self._is_known(scope):
                await self._app(scope, receive, send)
            else:
                await receive()
                await send({'type': 'websocket.close', 'code': 1008})
        else:
            await self._answer(scope, receive, _with_security_headers(send))

    async def _answer(self, scope: dict[str, Any], receive: Callable, send: Callable) -> None:
        """Answer a request over HTTP, or reject it."""
        if not await self._rate.admits(_address(scope)):
            await respond(send, 429, TOO_MANY, (b'retry-after', b'5'))
        elif not self._is_own_site(scope):
            await respond(send, 403, OTHER_SITE)
        elif self._is_known(scope):
            await self._app(scope, receive, send)
        elif self._token:
            await self._ask_for_token(scope, receive, send)
        else:
            await respond(send, 403, LOCAL_ONLY)

    def _is_own_site(self, scope: dict[str, Any]) -> bool:
        """Whether no other site has sent the request, by what the browser says."""
        origin = header(scope, b'origin')
        hosts = [header(scope, b'host')]
        if self._token:  # a site cannot have a browser send this one; a proxy can
            hosts.append(header(scope, b'x-forwarded-host'))
        try:
            return header(scope, b'sec-fetch-site') in OWN_SITE and (
                not origin or urlsplit(origin).netloc in filter(None, hosts))
        except ValueError:  # this cannot be an origin
            return False

    def _is_known(self, scope: dict[str, Any]) -> bool:
        """Whether a visitor has our cookie; without a token, is on this machine."""
        if not self._token:
            try:
                return urlsplit(f'//{header(scope, b"host")}').hostname in LOCAL_HOSTS
            except ValueError:  # this cannot be a host
                return False
        pairs = (each.strip().partition('=') for each in header(scope, b'cookie').split(';'))
        return any(_is_same(value, self._session) for name, _, value in pairs
                   if name == self._cookie_name(scope))

    async def _ask_for_token(self, scope: dict[str, Any], receive: Callable,
                             send: Callable) -> None:
        """Set the cookie if the address or the form holds the right token; else show the form."""
        given = scope['query_string'] if scope['method'] != 'POST' else await _body(receive)
        token = parse_qs(given.decode('latin-1')).get('token', [''])[0]
        address = _address(scope)
        wait = ceil(self._guesses.wait(address)) if token else 0
        if wait:
            await respond(send, 429, FORM.format(f'Too many wrong tokens: wait {wait} s.'),
                          (b'retry-after', str(wait).encode()))
        elif _is_same(token, self._token):
            # Location and path are relative to what the browser asked for, also behind a proxy.
            cookie = f'{self._cookie_name(scope)}={self._session}; HttpOnly; SameSite=Lax'
            await respond(send, 303, '', (b'location', b'./'), (b'set-cookie', cookie.encode()))
        else:
            if token:
                self._guesses.add(address)
                self._log(f'a visitor from {address} gave a wrong token')
            await respond(send, 401, FORM.format('This is not the token.' if token else ''))

    def _cookie_name(self, scope: dict[str, Any]) -> str:
        """Name of the cookie: browsers send those of all ports of a host."""
        return f'{COOKIE}_{(scope.get("server") or ("", 0))[1]}'


def header(scope: dict[str, Any], name: bytes) -> str:
    """Value of a header of a request, '' where there is none."""
    return dict(scope['headers']).get(name, b'').decode('latin-1')


async def respond(send: Callable, code: int, text: str, *headers: tuple[bytes, bytes]) -> None:
    """Send a page of HTML."""
    await send({'type': 'http.response.start', 'status': code, 'headers': [
        (b'content-type', b'text/html; charset=utf-8'), (b'cache-control', b'no-store'),
        *headers]})
    await send({'type': 'http.response.body', 'body': text.encode()})


def _address(scope: dict[str, Any]) -> str:
    """Address that a request comes from; '?' where that is not known."""
    return (scope.get('client') or ('?',))[0]


def _is_same(given: str, secret: str) -> bool:
    return hmac.compare_digest(given.encode(), secret.encode())


def _with_security_headers(send: Callable) -> Callable:
    """Return a `send` that adds the security headers to each response."""
    async def send_with_headers(message: dict[str, Any]) -> None:
        if message['type'] == 'http.response.start':
            message = {**message, 'headers': [*message.get('headers', ()), *SECURITY_HEADERS]}
        await send(message)
    return send_with_headers


async def _body(receive: Callable) -> bytes:
    body, more = b'', True
    while more and len(body) < MAX_FORM_SIZE:
        message = await receive()
        body, more = body + message.get('body', b''), message.get('more_body', False)
    return body[:MAX_FORM_SIZE]
