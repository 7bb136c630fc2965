"""A reverse proxy under a path, as `location /papilla/ { proxy_pass http://service/; }` of nginx makes one."""

import socket
import threading

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


def pump(source: socket.socket, sink: socket.socket) -> None:
    try:
        while piece := source.recv(65536):
            sink.sendall(piece)
    except OSError:
        pass
    # One end is gone, and with it the other: a session must see that at once.
    for end in (source, sink):
        try:
            end.shutdown(socket.SHUT_RDWR)
        except OSError:
            pass


def serve(client: socket.socket, port: int, path: bytes) -> None:
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
                pump(service, client)
                other.join()
        except OSError:
            pass


def listen(port: int, path: str) -> int:
    """Serves the service at `port` under a path; the proxy's own port."""
    listening = socket.create_server(("127.0.0.1", 0), backlog=64)

    def accept() -> None:
        while True:
            client, _ = listening.accept()
            threading.Thread(target=serve, args=(client, port, path.encode()), daemon=True).start()

    threading.Thread(target=accept, daemon=True).start()
    return int(listening.getsockname()[1])
