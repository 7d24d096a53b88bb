# SPDX-License-Identifier: Apache-2.0
"""Where the token of the page can be seen, and where not."""

from contextlib import contextmanager
import http.client
import os
from pathlib import Path
import pty
import re
import subprocess
import sys
import urllib.error
import urllib.request

from http_server import http_server
from node_processes import run
import pytest
from rcl_interfaces.msg import Log
from rcl_interfaces.srv import GetParameters, ListParameters
from rclpy.qos import DurabilityPolicy, QoSProfile
from ros_client import ros_client
from waiting import wait_until

from comply_ros.nodes.node_processes import START
from comply_ros.nodes.parameters import TOKEN_FILE

COMMAND = [sys.executable, '-c', START.format('dashboard'), '--ros-args', '-p', 'port:=0',
           '-p', 'address:=0.0.0.0', '-p', 'teach:=false']


@contextmanager
def dashboard_in_terminal(*arguments, **environment):
    """Run a dashboard that other machines reach; give it, and what its terminal has shown."""
    user, terminal = pty.openpty()
    os.set_blocking(user, False)
    shown = []

    def text():
        try:
            shown.append(os.read(user, 100_000).decode())
        except BlockingIOError:
            pass
        return ''.join(shown)
    process = subprocess.Popen([*COMMAND, *arguments], stdin=terminal, stdout=terminal,
                               stderr=terminal, env={**os.environ, **environment})
    try:
        wait_until(lambda: 'ready:' in text() or process.poll() is not None, 'page')
        assert process.poll() is None, text()
        yield process, text
    finally:
        process.terminate()
        process.wait()
        os.close(user)
        os.close(terminal)


def opens(url):
    """Whether a URL opens the page."""
    opener = urllib.request.build_opener(urllib.request.HTTPCookieProcessor())
    try:
        return b'_nicegui' in opener.open(url).read()
    except urllib.error.HTTPError as error:
        assert error.code == 401
        return False


def test_a_token_that_is_made_is_shown_in_the_terminal_alone(domain, tmp_path):
    logs = tmp_path / 'logs'
    with ros_client() as client, dashboard_in_terminal(ROS_LOG_DIR=str(logs)) as (process, text):
        shown = re.search(r':(\d+)/\?token=(\S+)', text())
        port, token = shown[1], shown[2]
        assert opens(f'http://127.0.0.1:{port}/?token={token}')
        assert not opens(f'http://127.0.0.1:{port}/')
        assert not opens(f'http://127.0.0.1:{port}/?token=wrong-token')
        lines = []
        client.create_subscription(Log, '/rosout', lambda msg: lines.append(msg.msg), QoSProfile(
            depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL))
        client.until(lambda: 'wrong token' in ''.join(lines), 'log of the wrong token')
        names = client.call(ListParameters, 'dashboard/list_parameters').result.names
        values = client.call(GetParameters, 'dashboard/get_parameters', names=names).values
        seen = (*lines, *map(str, values), Path(f'/proc/{process.pid}/cmdline').read_text(),
                *(each.read_text() for each in logs.rglob('*') if each.is_file()))
        assert any('ready:' in each for each in seen)
        assert not [each for each in seen if token in each]


@pytest.mark.long
def test_without_a_terminal_a_token_needs_a_file(domain):
    done = subprocess.run(COMMAND, capture_output=True, text=True, check=False,
                          start_new_session=True, stdin=subprocess.DEVNULL)
    assert done.returncode == 2
    assert 'dashboard: parameter token_file must name a file' in done.stderr


def test_a_token_file_that_does_not_exist_is_created_for_its_user_alone(domain, tmp_path):
    file = tmp_path / 'token'
    with dashboard_in_terminal('-p', f'token_file:={file}') as (_, text):
        assert file.stat().st_mode & 0o777 == 0o600
        token, port = file.read_text().strip(), re.search(r':(\d+)/', text())[1]
        assert token not in text() and opens(f'http://127.0.0.1:{port}/?token={token}')


@pytest.mark.long
def test_a_token_file_of_a_user_may_have_a_byte_order_mark_and_blanks(domain, tmp_path):
    file = tmp_path / 'token'
    file.touch(mode=0o600)
    file.write_bytes(b'\xef\xbb\xbfopen-sesame \r\n')
    with dashboard_in_terminal('-p', f'token_file:={file}') as (_, text):
        port = re.search(r':(\d+)/', text())[1]
        assert opens(f'http://127.0.0.1:{port}/?token=open-sesame')


@pytest.mark.parametrize('mode, content, sentence', [
    (0o644, 'open-sesame', 'parameter token_file must be a file that only you may read'),
    (0o600, 'short', 'the token in token_file'), (0o600, 'two words', 'the token in token_file')])
def test_a_token_file_that_others_may_read_or_guess_is_rejected(
        domain, tmp_path, mode, content, sentence):
    file = tmp_path / 'token'
    file.write_text(content)
    file.chmod(mode)
    done = run('dashboard', '--ros-args', '-p', f'{TOKEN_FILE.name}:={file}')
    assert done.returncode == 2 and done.stderr.startswith(f'dashboard: {sentence}')
    assert content not in done.stderr


def test_a_token_of_the_environment_is_checked_and_not_shown(domain):
    done = run('dashboard', '--ros-args', COMPLY_ROS_TOKEN='sesame!')
    assert done.returncode == 2 and 'sesame!' not in done.stderr
    assert done.stderr.startswith('dashboard: the token in environment variable COMPLY_ROS_TOKEN')


@contextmanager
def proxy(port):
    """Serve `/robot/...` from a port, as a web server in front of it does; give the URL."""
    def forward(request):
        length = int(request.headers.get('content-length', 0))
        asked = http.client.HTTPConnection('127.0.0.1', port)
        asked.request(request.command, request.path.removeprefix('/robot'),
                      request.rfile.read(length), {
                          **{name: value for name, value in request.headers.items()
                             if name.lower() != 'host'}, 'Accept-Encoding': 'identity',
                          'Host': 'inner', 'X-Forwarded-Host': request.headers['host'],
                          'X-Forwarded-Prefix': '/robot'})
        answer = asked.getresponse()
        passed = [(name, value) for name, value in answer.getheaders()
                  if name.lower() in ('location', 'set-cookie', 'content-type')]
        return answer.status, passed, answer.read()
    with http_server(forward) as url:
        yield f'{url}robot/'


@pytest.mark.long
def test_behind_a_proxy_with_a_path_the_door_stays_there(domain):
    with dashboard_in_terminal(COMPLY_ROS_TOKEN='open-sesame') as (_, text), \
            proxy(int(re.search(r':(\d+)/', text())[1])) as url:
        opener = urllib.request.build_opener(urllib.request.HTTPCookieProcessor())
        answer = opener.open(urllib.request.Request(url, b'token=open-sesame', {
            'Origin': url.removesuffix('/robot/')}))
        assert answer.url == url and b'"/robot/_nicegui/' in answer.read()


@pytest.mark.long
def test_the_address_of_all_interfaces_serves_ipv4_and_ipv6(domain):
    with dashboard_in_terminal('-p', 'address:="::"', COMPLY_ROS_TOKEN='open-sesame') as (_, text):
        port = re.search(r':(\d+)/', text())[1]
        for host in '127.0.0.1', '[::1]':
            assert opens(f'http://{host}:{port}/?token=open-sesame')
