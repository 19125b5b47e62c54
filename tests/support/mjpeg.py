"""A camera on the network: an MJPEG stream on loopback, of pictures that a test makes."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import cv2
import numpy as np
from numpy.typing import NDArray

Picture = NDArray[np.uint8]


class Stream:
    """Serves `picture()` at some 30 frames a second, each `latency` frames after it was taken."""

    def __init__(self, picture: Callable[[], Picture], latency: int = 0) -> None:
        self.goes_on = threading.Event()
        self.goes_on.set()
        self.unplugged = False
        stream = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                self.send_response(200)
                self.send_header("Content-Type", "multipart/x-mixed-replace; boundary=frame")
                self.end_headers()
                under_way = deque([picture()] * latency)
                while not stream.unplugged:
                    if stream.goes_on.is_set():
                        under_way.append(picture())
                        if not self._send(under_way.popleft()):
                            return
                    time.sleep(1 / 30)

            def _send(self, shown: Picture) -> bool:
                data = cv2.imencode(".jpg", shown, [cv2.IMWRITE_JPEG_QUALITY, 100])[1].tobytes()
                head = f"--frame\r\nContent-Type: image/jpeg\r\nContent-Length: {len(data)}\r\n\r\n"
                try:
                    self.wfile.write(head.encode() + data + b"\r\n")
                except OSError:
                    return False
                return True

            def log_message(self, *args: object) -> None:
                pass

        self._server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self._server.daemon_threads = True
        self._thread = threading.Thread(target=self._server.serve_forever, kwargs={"poll_interval": 0.05})
        self._thread.start()
        self.url = f"http://127.0.0.1:{self._server.server_port}/stream.mjpg"

    def close(self) -> None:
        self.unplugged = True
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()
