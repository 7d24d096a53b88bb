# SPDX-License-Identifier: Apache-2.0
"""Which requests reach the page."""

import asyncio

import pytest

from comply_ros.dashboard.access_control import AccessControl
from comply_ros.dashboard.request_rate import RateLimit, RequestRate

TOKEN = 'open-sesame'


async def _page(scope, receive, send):
    await send({'type': 'page'})


def requests(token, *given, log=lambda text: None, rate=None):
    """Return the messages that a visitor receives for each of some requests, as `request` has."""
    async def send_all():
        control = AccessControl(_page, token, log, rate)
        return [await answers(control, *each[0], **each[1]) for each in given]
    return asyncio.run(send_all())


async def answers(control, kind='http', method='GET', query=b'', body=b'', client='10.0.0.7',
                  **headers):
    """Return the messages that a visitor receives; _ in names of headers stands for -."""
    sent = []

    async def receive():
        return {'type': 'http.request', 'body': body}

    async def send(message):
        sent.append(message)
    await control({'type': kind, 'method': method, 'query_string': query, 'client': (client, 5000),
                   'server': ('0.0.0.0', 80), 'headers': [
                       (name.replace('_', '-').encode(), value.encode())
                       for name, value in headers.items()]}, receive, send)
    return sent


def request(token, **given):
    """Return the messages that a visitor receives."""
    return requests(token, ((), given))[0]


def guess(token, client='10.0.0.7'):
    """Request that gives a token in the form."""
    return (), {'method': 'POST', 'body': f'token={token}'.encode(), 'host': 'robot',
                'client': client}


def is_allowed(token, **settings):
    """Whether a request reaches the page."""
    return request(token, **settings) == [{'type': 'page'}]


def statuses(answered):
    """Return the status of each answer."""
    return [each[0]['status'] for each in answered]


@pytest.mark.parametrize('host', ['localhost:8080', '127.0.0.1:1', '[::1]:8080', 'localhost'])
def test_this_machine_needs_no_token(host):
    for own in ('same-origin', 'none'):
        assert is_allowed('', host=host, sec_fetch_site=own)
    assert is_allowed('', kind='websocket', host=host)


@pytest.mark.parametrize('headers', [
    {'host': 'rebound.example:8080'}, {},
    {'host': 'localhost:8080', 'origin': 'http://elsewhere.example'},
    {'host': 'localhost:8080', 'origin': 'null'},
    {'host': 'localhost:8080', 'origin': 'http://localhost:3000'},
    {'host': 'localhost:8080', 'origin': 'http://proxy', 'x_forwarded_host': 'proxy'},
    {'host': 'localhost:8080', 'sec_fetch_site': 'cross-site'},
    {'host': 'localhost:8080', 'sec_fetch_site': 'same-site'},
    {'host': '['}, {'host': 'localhost', 'origin': 'http://['}])
def test_other_sites_do_not_reach_the_page_of_this_machine(headers):
    assert request('', **headers)[0]['status'] == 403
    assert request('', kind='websocket', **headers) == [{'type': 'websocket.close', 'code': 1008}]


def test_who_is_sent_by_a_link_of_another_site_can_open_the_page():
    answer = request('', host='localhost:8080', sec_fetch_site='cross-site')
    assert b'<a href="?">Open the page</a>' in answer[1]['body']


def cookie_of(answer):
    """Return the name and value of the cookie that an answer sets."""
    return dict(answer[0]['headers'])[b'set-cookie'].decode().split(';')[0]


def after_login(**given):
    """Return the answer to a request of a visitor who gave the right token."""
    async def visit():
        control = AccessControl(_page, TOKEN)
        login = await answers(control, *guess(TOKEN)[0], **guess(TOKEN)[1])
        return await answers(control, cookie=f'other={{"a":1}}; {cookie_of(login)}', **given)
    return asyncio.run(visit())


@pytest.mark.parametrize('headers', [
    {'host': 'robot:8080'}, {'host': 'robot:8080', 'origin': 'http://robot:8080'},
    {'host': 'inner', 'x_forwarded_host': 'proxy', 'origin': 'https://proxy'}])
def test_who_knows_the_token_may_see_the_page_from_anywhere(headers):
    for kind in ('http', 'websocket'):
        assert after_login(kind=kind, **headers) == [{'type': 'page'}]


def test_another_site_does_not_use_the_cookie_of_a_visitor():
    for headers in ({'sec_fetch_site': 'cross-site'}, {'origin': 'http://elsewhere.example'}):
        assert after_login(host='robot', **headers)[0]['status'] == 403
        assert after_login(kind='websocket', host='robot', **headers)[0]['code'] == 1008


@pytest.mark.parametrize('cookie', [
    '', 'comply_ros_80=', f'comply_ros_80={TOKEN}', 'comply_ros_80=\xff', ';=;', '['])
def test_without_the_token_no_request_is_allowed_even_on_this_machine(cookie):
    assert request(TOKEN, host='localhost:8080', cookie=cookie)[0]['status'] == 401
    assert not is_allowed(TOKEN, kind='websocket', host='localhost:8080', cookie=cookie)


def test_the_right_token_brings_a_cookie_that_is_another_secret():
    for given in ({'query': f'token={TOKEN}'.encode()},
                  {'method': 'POST', 'body': f'token={TOKEN}'.encode()}):
        answer = request(TOKEN, host='robot', **given)[0]
        headers = dict(answer['headers'])
        assert answer['status'] == 303
        assert headers[b'location'] == b'./'  # also behind a proxy with a path
        assert headers[b'set-cookie'].endswith(b'HttpOnly; SameSite=Lax')
        assert TOKEN.encode() not in headers[b'set-cookie']


def test_a_wrong_token_is_reported_and_not_shown_again():
    answer = request(TOKEN, host='robot', method='POST', body=b'token=<script>')
    assert answer[0]['status'] == 401
    assert b'This is not the token.' in answer[1]['body'] and b'<script>' not in answer[1]['body']


def test_wrong_guesses_are_slowed_for_one_address_and_logged():
    logged = []
    answered = requests(TOKEN, *[guess('wrong-guess')] * 7, guess(TOKEN), guess(TOKEN, '10.0.0.8'),
                        log=logged.append)
    assert statuses(answered) == [401] * 5 + [429] * 3 + [303]
    assert b'wait 2 s' in answered[-2][1]['body']
    assert logged == ['a visitor from 10.0.0.7 gave a wrong token'] * 5


def test_an_address_that_sends_too_many_requests_waits_and_others_do_not():
    delays = []

    async def sleep(seconds):
        delays.append(seconds)
    loop = [((), {'host': 'robot'})] * 5
    answered = requests(TOKEN, *loop, ((), {'host': 'robot', 'client': '10.0.0.8'}),
                        rate=RequestRate(RateLimit(3, 1000.0), sleep))
    assert statuses(answered) == [401] * 3 + [429] * 2 + [401]
    assert len(delays) == 2


@pytest.mark.parametrize('given', [
    {'host': 'localhost'}, {'host': 'elsewhere.example'},
    {'host': 'localhost', 'sec_fetch_site': 'cross-site'}])
@pytest.mark.parametrize('token', ['', TOKEN])
def test_every_answer_says_that_no_page_may_frame_it(token, given):
    async def page(scope, receive, send):
        await send({'type': 'http.response.start', 'status': 200, 'headers': []})

    async def visit():
        return await answers(AccessControl(page, token), **given)
    headers = dict(asyncio.run(visit())[0]['headers'])
    assert b"frame-ancestors 'none'" in headers[b'content-security-policy']
    assert headers[b'x-content-type-options'] == b'nosniff'
    assert headers[b'x-frame-options'] == b'DENY'
