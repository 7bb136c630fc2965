"""A reverse proxy under a path, as `location /papilla/ { proxy_pass http://service/; }` of nginx makes one.

It can also keep back what the service says that it remembers (docs/reference/protocol-moving.md): `Seals`.
"""

import json
import socket
import threading
import time

HEAD_BYTES_MAX = 65536
NOT_HERE = b"HTTP/1.1 404 Not Found\r\ncontent-length: 0\r\nconnection: close\r\n\r\n"


def read_head(client: socket.socket) -> tuple[bytes, bytes]:
    """A request's head, and what came behind it."""
    text = b""
    while b"\r\n\r\n" not in text:
        piece = client.recv(65536)
        if not piece or len(text) > HEAD_BYTES_MAX:
            return b"", b""
        text += piece
    head, _, rest = text.partition(b"\r\n\r\n")
    return head, rest


def without(head: bytes, path: bytes) -> bytes | None:
    """The head for the service; None: its path is another."""
    line, *headers = head.split(b"\r\n")
    method, target, version = line.split(b" ")
    if not target.startswith(path + b"/"):
        return None
    upgrades = any(header.lower().startswith(b"upgrade:") for header in headers)
    if not upgrades:
        # One request a connection: what follows would have to be rewritten too.
        headers = [h for h in headers if not h.lower().startswith(b"connection:")] + [b"Connection: close"]
    return b"\r\n".join([b" ".join([method, target[len(path) :], version]), *headers, b"", b""])


class Seals:
    """What becomes of the sealed states that come by: the first is refused, the second comes too late, all others pass."""

    LATE_S = 6.5
    REFUSAL = {"type": "error", "code": "internal", "message": "the state cannot be sealed", "closes": False}

    def __init__(self) -> None:
        self.seen = 0

    def frame(self, frame: bytes, payload: bytes) -> bytes:
        """A WebSocket message of the service as it goes on."""
        if frame[0] & 0x0F != 2 or not payload.startswith(b"PPS"):
            return frame
        self.seen += 1
        if self.seen == 1:
            text = json.dumps(self.REFUSAL).encode()
            assert len(text) < 126
            return bytes([0x81, len(text)]) + text
        if self.seen == 2:
            # All that comes after it is late too: a connection keeps its order.
            time.sleep(self.LATE_S)
        return frame


class Messages:
    """Cuts what a service sends into the head of its answer and WebSocket frames, which it does not mask."""

    def __init__(self, seals: Seals) -> None:
        self.seals, self.rest, self.has_head = seals, b"", False

    def take(self, piece: bytes) -> bytes:
        """What goes on now."""
        self.rest += piece
        out = b""
        if not self.has_head:
            head, end, after = self.rest.partition(b"\r\n\r\n")
            if not end:
                return b""
            out, self.rest, self.has_head = head + end, after, True
        while len(self.rest) >= 2:
            size, at = self.rest[1] & 0x7F, 2
            if size >= 126:
                at = 4 if size == 126 else 10
                if len(self.rest) < at:
                    break
                size = int.from_bytes(self.rest[2:at], "big")
            if len(self.rest) < at + size:
                break
            out += self.seals.frame(self.rest[: at + size], self.rest[at : at + size])
            self.rest = self.rest[at + size :]
        return out


def pump(source: socket.socket, sink: socket.socket, messages: Messages | None = None) -> None:
    try:
        while piece := source.recv(65536):
            sink.sendall(messages.take(piece) if messages else piece)
    except OSError:
        pass
    # One end is gone, and with it the other: a session must see that at once.
    for end in (source, sink):
        try:
            end.shutdown(socket.SHUT_RDWR)
        except OSError:
            pass


def serve(client: socket.socket, port: int, path: bytes, seals: Seals | None) -> None:
    with client:
        client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        try:
            head, rest = read_head(client)
            asked = without(head, path) if head else None
            if asked is None:
                client.sendall(NOT_HERE)
                return
            with socket.create_connection(("127.0.0.1", port), timeout=5) as service:
                service.settimeout(None)
                service.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                service.sendall(asked + rest)
                other = threading.Thread(target=pump, args=(client, service), daemon=True)
                other.start()
                is_session = asked.split(b" ", 2)[1].startswith(b"/v1/session")
                pump(service, client, Messages(seals) if seals and is_session else None)
                other.join()
        except OSError:
            pass


def listen(port: int, path: str, seals: Seals | None = None) -> int:
    """Serves the service at `port` under a path; the proxy's own port."""
    listening = socket.create_server(("127.0.0.1", 0), backlog=64)

    def accept() -> None:
        while True:
            client, _ = listening.accept()
            threading.Thread(target=serve, args=(client, port, path.encode(), seals), daemon=True).start()

    threading.Thread(target=accept, daemon=True).start()
    return int(listening.getsockname()[1])
