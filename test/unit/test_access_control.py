# SPDX-License-Identifier: Apache-2.0
"""Which requests reach the page."""

import asyncio

import pytest

from comply_ros.dashboard.access_control import AccessControl

TOKEN = 'open-sesame'


async def _page(scope, receive, send):
    await send({'type': 'page'})


def request(token, *, kind='http', method='GET', query=b'', body=b'', **headers):
    """Return the messages that a visitor receives."""
    sent = []

    async def receive():
        return {'type': 'http.request', 'body': body}

    async def send(message):
        sent.append(message)
    scope = {'type': kind, 'method': method, 'query_string': query, 'headers': [
        (name.encode(), value.encode()) for name, value in headers.items()]}
    asyncio.run(AccessControl(_page, token)(scope, receive, send))
    return sent


def is_allowed(*arguments, **settings):
    """Whether a request reaches the page."""
    return request(*arguments, **settings) == [{'type': 'page'}]


@pytest.mark.parametrize('host', ['localhost:8080', '127.0.0.1:1', '[::1]:8080', 'localhost'])
def test_this_machine_needs_no_token(host):
    assert is_allowed('', host=host)
    assert is_allowed('', kind='websocket', host=host)


@pytest.mark.parametrize('headers', [
    {'host': 'rebound.example:8080'}, {},
    {'host': 'localhost:8080', 'origin': 'http://elsewhere.example'},
    {'host': 'localhost:8080', 'origin': 'null'},
    {'host': '['}, {'host': 'localhost', 'origin': 'http://['}])
def test_other_sites_do_not_reach_the_page_of_this_machine(headers):
    assert request('', **headers)[0]['status'] == 403
    assert request('', kind='websocket', **headers) == [{'type': 'websocket.close', 'code': 1008}]


def test_who_knows_the_token_may_see_the_page_from_anywhere():
    cookie = f'other={{"a":1}}; comply_ros_token={TOKEN}'
    assert is_allowed(TOKEN, host='robot:8080', cookie=cookie)
    assert is_allowed(TOKEN, kind='websocket', host='robot:8080', origin='http://robot:8080',
                     cookie=cookie)


@pytest.mark.parametrize('cookie', [
    '', 'comply_ros_token=', f'comply_ros_token={TOKEN}x', 'comply_ros_token=\xff', ';=;', '['])
def test_without_the_token_no_request_is_allowed_even_on_this_machine(cookie):
    assert request(TOKEN, host='localhost:8080', cookie=cookie)[0]['status'] == 401
    assert not is_allowed(TOKEN, kind='websocket', host='localhost:8080', cookie=cookie)


def test_the_right_token_is_stored_in_a_cookie_that_scripts_and_other_sites_do_not_get():
    for given in ({'query': f'token={TOKEN}'.encode()},
                  {'method': 'POST', 'body': f'token={TOKEN}'.encode()}):
        answer = request(TOKEN, host='robot', **given)[0]
        headers = dict(answer['headers'])
        assert answer['status'] == 303 and headers[b'location'] == b'/'
        assert headers[b'set-cookie'].endswith(b'HttpOnly; SameSite=Lax')


def test_a_wrong_token_is_reported_and_not_shown_again():
    answer = request(TOKEN, host='robot', method='POST', body=b'token=<script>')
    assert answer[0]['status'] == 401
    assert b'This is not the token.' in answer[1]['body'] and b'<script>' not in answer[1]['body']
