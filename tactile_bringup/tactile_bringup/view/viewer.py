# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The Rerun viewer, a process of its own, and the recording that goes to it."""
from __future__ import annotations

import json
import os
import re
import signal
import socket
import subprocess
import tempfile
import threading
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from urllib.parse import quote

import rerun as rr

from .constants import VIEW

_FOREIGN_LINK = re.compile(rb'<link[^>]*https?://[^>]*>')
_MEMORY = '1GB'  # beyond it the viewer forgets what is oldest


@contextmanager
def to_file(path: Path) -> Iterator[rr.RecordingStream]:
    """Context with a recording that is written to a .rrd file, up to Ctrl-C; after an error there is no file."""
    part = path.with_name(path.name + '.part')
    stream = rr.RecordingStream('tactile', recording_id=path.stem)
    stream.save(part)
    try:
        with suppress(KeyboardInterrupt):
            yield stream
    except BaseException:
        stream.disconnect()
        part.unlink()
        raise
    stream.flush()
    stream.disconnect()
    part.replace(path)


class Viewer:
    """A running viewer, which ends with the context.

    Parameters
    ----------
    web : bool
        In a browser, else in a window.
    address : str
        Address on which it listens.
    """

    def __init__(self, web: bool, address: str):
        self._web, self._address, self._port = web, address, _free_port(VIEW.grpc_port)
        self.stream = rr.RecordingStream('tactile')

    def __enter__(self) -> Viewer:
        self._config = tempfile.TemporaryDirectory(prefix='tactile_view_')
        inner = _free_port()
        shown = ['--serve-web', '--web-viewer-port', str(inner), '--server-memory-limit', _MEMORY] if self._web else \
            ['--expect-data-soon', '--memory-limit', _MEMORY]
        self._process = subprocess.Popen(['rerun', '--bind', self._address, '--port', str(self._port), *shown],
                                         env=os.environ | without_statistics(self._config.name), start_new_session=True)
        self.stream.connect_grpc(f'rerun+http://127.0.0.1:{self._port}/proxy')
        self._page = _serve_page(self._address, inner, self._port) if self._web else None
        return self

    @property
    def is_open(self) -> bool:
        """Whether the viewer runs: its window has not been closed."""
        return self._process.poll() is None

    def wait(self) -> None:
        """Wait until the window is closed."""
        self._process.wait()

    def __exit__(self, *_exc) -> None:
        if self._page:
            self._page.shutdown()
        sent = threading.Thread(target=self.stream.disconnect, daemon=True)  # sends what waits; a viewer that hangs takes nothing
        sent.start()
        sent.join(VIEW.last_data_s)
        with suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGKILL)  # rerun itself is a child of Python's script of that name
        self._process.wait()
        sent.join()
        self._config.cleanup()


def _serve_page(address: str, inner: int, port: int) -> ThreadingHTTPServer:
    """Serve the page that Rerun has on a port of its own, inner, as one that may connect to nothing but the recording: in a browser Rerun
    would send usage statistics and ask for new versions."""
    class _Page(BaseHTTPRequestHandler):
        def do_GET(self) -> None:  # noqa: N802, the name that http.server calls
            """Answer with what Rerun's own page answers."""
            try:
                answer = urllib.request.urlopen(f'http://{address}:{inner}{self.path}')
            except OSError as error:
                self.send_error(502, str(error))
                return
            with answer:
                body = answer.read()
                if answer.headers.get_content_type() == 'text/html':
                    body = _FOREIGN_LINK.sub(b'', body)  # a font of Google's
                self.send_response(answer.status)
                self.send_header('Content-Length', str(len(body)))
                for name in ('Content-Type', 'Content-Encoding'):
                    if name in answer.headers:
                        self.send_header(name, answer.headers[name])
                self.send_header('Content-Security-Policy', f"connect-src 'self' http://*:{port}; style-src 'self' 'unsafe-inline'")
                self.end_headers()
                self.wfile.write(body)

        def log_message(self, *_args) -> None:
            """Say nothing."""

    page = ThreadingHTTPServer((address, _free_port(VIEW.web_port)), _Page)
    threading.Thread(target=page.serve_forever, daemon=True).start()
    own, recording = page.server_address[1], quote(f'rerun+http://localhost:{port}/proxy', safe='')
    print(f'view: open http://localhost:{own}/?url={recording} in a browser; from another computer first '
          f'ssh -L {own}:localhost:{own} -L {port}:localhost:{port} THIS_COMPUTER', flush=True)
    return page


def without_statistics(folder: str) -> dict[str, str]:
    """Environment variables with which Rerun sends no usage statistics, by a configuration in this folder."""
    file = Path(folder, 'rerun', 'analytics.json')
    file.parent.mkdir()
    file.write_text(json.dumps({'analytics_enabled': False, 'analytics_id': '', 'metadata': {}, 'config_file_path': str(file),
                                'data_dir_path': folder}))
    return {'XDG_CONFIG_HOME': folder}


def _free_port(usual: int = 0) -> int:
    """The usual port, or another one where it is taken."""
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(('127.0.0.1', usual))
        except OSError:
            probe.bind(('127.0.0.1', 0))
        return probe.getsockname()[1]
