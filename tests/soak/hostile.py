"""Clients that send without a pause or ask for what is hard, beside a session that is judged.

Each kind of flood runs from four processes beside one session of 90 Hz and a balancer that asks for
/healthz; before it, four idle sessions stand in their place. A kind is sound if the judged session's
p99 is at most twice that beside idle sessions plus 5 ms, no frame is lost, and every /healthz comes
within 100 ms. Sessions whose frames are hard (sessions.py, which `./test` runs in short form) and
hellos whose client leaves may cost 10 ms in place of 5.
"""

import json
import multiprocessing
import socket
import ssl
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from service import RELEASE, ROOT, processor  # noqa: E402
from sessions import FRAME, SESSIONS, hello_of, payload_of, slivers  # noqa: E402

HOST, PORT = "127.0.0.1", 7323
# The rate of requests is an address's.
BALANCER, NEIGHBOUR = "127.0.0.2", "127.0.0.3"
CLIENTS = 4
RATE_HZ = 90
HANDSHAKE = (
    f"GET /v1/session HTTP/1.1\r\nHost: {HOST}:{PORT}\r\nConnection: upgrade\r\nUpgrade: websocket\r\n"
    "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
).encode()
HEADER = struct.Struct("<4sBBBBIHHQIfHHIIHBB")
CONTINUATION, TEXT, BINARY, PING, PONG, FINAL = 0, 1, 2, 9, 10, 0x80


def frame_of(first: int, payload: bytes = b"") -> bytes:
    """A WebSocket frame as clients send it, under a mask of zeros."""
    n = len(payload)
    if n <= 125:
        length = bytes([0x80 | n])
    elif n <= 65535:
        length = bytes([0x80 | 126]) + struct.pack(">H", n)
    else:
        length = bytes([0x80 | 127]) + struct.pack(">Q", n)
    return bytes([first]) + length + bytes(4) + payload


def hello(**members: object) -> bytes:
    text = json.dumps({"type": "hello", "tier": "nano", "sample_type": "u8", **members})
    return frame_of(FINAL | TEXT, text.encode())


def pressure(sequence: int, side: int) -> bytes:
    """A frame of the protocol whose window of SIDE x SIDE pixels is under 5 kPa."""
    time_us, at = time.monotonic_ns() // 1000, (224 - side) // 2
    head = HEADER.pack(b"PPL1", 3, 1, 3, 0, sequence, side, side, time_us, 0, 50.0, at, at, 0, 0, 0, 0, 0)
    return frame_of(FINAL | BINARY, head + bytes([100]) * (side * side))


def connect(context: ssl.SSLContext | None, source: str = HOST) -> socket.socket:
    stream = socket.create_connection((HOST, PORT), timeout=30, source_address=(source, 0))
    stream.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return context.wrap_socket(stream, server_hostname="localhost") if context else stream


def trusting(certificate: str | None) -> ssl.SSLContext | None:
    return ssl.create_default_context(cafile=certificate) if certificate else None


# Kinds of floods: what is sent once after the handshake, and again and again.
FLOODS = {
    "windows": (hello(), b"".join(pressure(n, 4) for n in range(1, 1000))),
    "pings": (hello(), frame_of(FINAL | PING) * 8192),
    "pings before the hello": (b"", frame_of(FINAL | PING) * 8192),
    "pongs": (hello(), frame_of(FINAL | PONG) * 8192),
    "pongs before the hello": (b"", frame_of(FINAL | PONG) * 8192),
    "hellos of 1 MB": (hello(), hello(effects=["x" * 1_000_000])),
    "pieces of nothing": (frame_of(BINARY), frame_of(CONTINUATION) * 8192),
    "whole maps": (hello(), b"".join(pressure(n, 128) for n in range(1, 40))),
}
# Whole requests, one behind the other on one connection.
REQUESTS = {
    "/v1/atlas.obj": "GET /v1/atlas.obj HTTP/1.1\r\nHost: {host}\r\n\r\n",
    "/v1/presses/0/sed": "GET /v1/presses/0/sed HTTP/1.1\r\nHost: {host}\r\nAccept: application/json\r\n\r\n",
}
IDLE = "idle"
# Clients that say a hello of some 400 kB, which takes long to check, and leave.
LEAVING = "hellos of slivers whose client leaves"
# Clients that ask for large answers by small frames, and read 80 kB of them a second.
SLOW = "slow readers"
HARD = [*SESSIONS, LEAVING, SLOW]


def flood(kind: str, certificate: str | None, stop: multiprocessing.Event, sent: multiprocessing.Value) -> None:
    """One client of a kind; turned away, it comes again."""
    while not stop.is_set():
        try:
            stream = connect(trusting(certificate))
            if kind in HARD:
                stream.sendall(HANDSHAKE)
                {LEAVING: leave, SLOW: read_slowly}.get(kind, press)(kind, stream, stop, sent)
                continue
            if kind in REQUESTS:
                opening, block = b"", REQUESTS[kind].format(host=f"{HOST}:{PORT}").encode() * 64
            else:
                opening, block = (hello(), b"") if kind == IDLE else FLOODS[kind]
                opening = HANDSHAKE + opening
            stream.sendall(opening)
            stream.setblocking(False)
            pour(stream, block, stop, sent)
        except OSError:
            time.sleep(0.01)


def pour(stream: socket.socket, block: bytes, stop: multiprocessing.Event, sent: multiprocessing.Value) -> None:
    """Sends as fast as it is taken, and reads what comes back, until the server ends it."""
    waits = (BlockingIOError, ssl.SSLWantReadError, ssl.SSLWantWriteError)
    # TLS wants the very bytes again that it could not write.
    left = memoryview(block)
    while not stop.is_set():
        is_waiting = True
        try:
            if block:
                n = stream.send(left)
                sent.value += n
                left = left[n:] or memoryview(block)
                is_waiting = False
        except waits:
            pass
        try:
            while stream.recv(1 << 18):
                is_waiting = False
                if stop.is_set():
                    return
                break
            else:
                return
        except waits:
            pass
        if is_waiting:
            time.sleep(0.001)


def rest(stream: socket.socket, seconds: float) -> None:
    """Reads what comes back and throws it away for so long."""
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0:
        stream.settimeout(left)
        try:
            if not stream.recv(1 << 18):
                raise ConnectionError("the server has closed")
        except TimeoutError:
            return


def press(kind: str, stream: socket.socket, stop: multiprocessing.Event, sent: multiprocessing.Value) -> None:
    """A session whose frames are hard: RATE_HZ of every finger. Refused, it tries again."""
    said = hello_of(kind)
    text, payload = json.dumps(said).encode(), payload_of(kind)
    fingers, columns, rows = len(said["fingers"]), *payload[1:]
    n = 0
    while not stop.is_set():
        if n % (8 * RATE_HZ) == 0:
            # Once in eight seconds: one that is refused goes on asking, one that is met is not hurt.
            stream.sendall(frame_of(FINAL | TEXT, text))
            rest(stream, 0.5)
        n += 1
        time_us = time.monotonic_ns() // 1000
        for finger in range(fingers):
            head = HEADER.pack(b"PPL1", 3, payload[0], 0, 0, n, columns, rows, time_us, 0, 1.0, 0, 0, 0, 0, 0, 0, finger)
            block = frame_of(FINAL | BINARY, head + FRAME[kind])
            stream.settimeout(30)
            stream.sendall(block)
            sent.value += len(block)
        rest(stream, 1 / RATE_HZ)


def leave(_: str, stream: socket.socket, __: multiprocessing.Event, sent: multiprocessing.Value) -> None:
    said = {"type": "hello", "input": "objects", "map": False, "objects": [{"shape": slivers(12288)}]}
    block = frame_of(FINAL | TEXT, json.dumps(said).encode())
    stream.sendall(block)
    sent.value += len(block)
    stream.close()


def read_slowly(_: str, stream: socket.socket, stop: multiprocessing.Event, sent: multiprocessing.Value) -> None:
    stream.sendall(hello(answer_sample_type="f32"))
    n = 0
    while not stop.is_set():
        n += 1
        block = pressure(n, 4)
        stream.settimeout(0.05)
        try:
            stream.sendall(block)
            sent.value += len(block)
            if not stream.recv(4096):
                return
        except TimeoutError:
            continue
        time.sleep(0.05)


def read_message(stream: socket.socket, buffer: bytearray) -> tuple[int, bytes]:
    def need(n: int) -> None:
        while len(buffer) < n:
            read = stream.recv(1 << 18)
            if not read:
                raise ConnectionError("the judged session was closed")
            buffer.extend(read)

    need(2)
    start, n = 2, buffer[1]
    if n == 126:
        need(4)
        start, n = 4, struct.unpack(">H", buffer[2:4])[0]
    elif n == 127:
        need(10)
        start, n = 10, struct.unpack(">Q", buffer[2:10])[0]
    need(start + n)
    kind, payload = buffer[0] & 15, bytes(buffer[start : start + n])
    del buffer[: start + n]
    return kind, payload


def judged(certificate: str | None, seconds: float, out: multiprocessing.Queue) -> None:
    """A session of 90 Hz from an address of its own: times of its round trips, s."""
    stream, buffer = connect(trusting(certificate), NEIGHBOUR), bytearray()
    stream.sendall(HANDSHAKE)
    while b"\r\n\r\n" not in buffer:
        buffer.extend(stream.recv(4096))
    if b" 101 " not in buffer[:16]:
        raise ConnectionError(f"no session: {bytes(buffer[:200])}")
    del buffer[: buffer.index(b"\r\n\r\n") + 4]
    stream.sendall(hello())
    read_message(stream, buffer)
    trips, lost, begun = [], 0, time.monotonic()
    for n in range(int(seconds * RATE_HZ)):
        time.sleep(max(0.0, begun + n / RATE_HZ - time.monotonic()))
        message = pressure(n + 1, 128)
        start = time.monotonic()
        stream.sendall(message)
        while True:
            kind, payload = read_message(stream, buffer)
            if kind in (BINARY, TEXT):
                break
        trips.append(time.monotonic() - start)
        # Status ok, and its own sequence; a text is an error.
        lost += kind == TEXT or payload[7] != 0 or struct.unpack("<I", payload[8:12])[0] != n + 1
    out.put((trips, lost))


def health(certificate: str | None, stop: multiprocessing.Event, out: multiprocessing.Queue) -> None:
    """A balancer on another address: times of /healthz, each on a connection of its own, s."""
    times = []
    while not stop.is_set():
        start = time.monotonic()
        stream = connect(trusting(certificate), BALANCER)
        stream.sendall(f"GET /healthz HTTP/1.1\r\nHost: {HOST}:{PORT}\r\nConnection: close\r\n\r\n".encode())
        answer = b""
        while read := stream.recv(4096):
            answer += read
        stream.close()
        times.append(time.monotonic() - start if b" 200 " in answer[:20] else float("inf"))
        time.sleep(0.1)
    out.put(times)


@contextmanager
def floods(kind: str, certificate: str | None) -> Iterator[tuple[multiprocessing.Event, multiprocessing.Value]]:
    """CLIENTS clients of a kind, at it for half a second already; the event that ends them and the
    bytes that they have sent.
    """
    stop, sent = multiprocessing.Event(), multiprocessing.Value("q", 0)
    clients = [multiprocessing.Process(target=flood, args=(kind, certificate, stop, sent)) for _ in range(CLIENTS)]
    for process in clients:
        process.start()
    time.sleep(0.5)
    try:
        yield stop, sent
    finally:
        stop.set()
        join(clients)


def join(processes: list[multiprocessing.Process]) -> None:
    """Waits for processes that were told to stop, and kills those that do not."""
    for process in processes:
        process.join(timeout=10)
        process.kill()


def beside(kind: str, certificate: str | None, seconds: float) -> dict:
    found, times = multiprocessing.Queue(), multiprocessing.Queue()
    with floods(kind, certificate) as (stop, sent):
        others = [
            multiprocessing.Process(target=judged, args=(certificate, seconds, found)),
            multiprocessing.Process(target=health, args=(certificate, stop, times)),
        ]
        for process in others:
            process.start()
        trips, lost = found.get(timeout=seconds + 120)
        stop.set()
        healths = times.get(timeout=120)
    join(others)
    trips.sort()
    at = lambda share: round(1000 * trips[min(len(trips) - 1, int(share * len(trips)))], 2)  # noqa: E731
    return {
        "kind": kind,
        "frames": len(trips),
        "lost": lost,
        "p50_ms": at(0.5),
        "p99_ms": at(0.99),
        "max_ms": round(1000 * trips[-1], 2),
        "health_max_ms": round(1000 * max(healths), 2),
        "sent_mb_per_s": round(sent.value / 1e6 / seconds, 2),
    }


def certificate_in(folder: str) -> list[str]:
    """Arguments that make the service speak TLS with a fresh certificate; empty without openssl."""
    key, certificate = f"{folder}/key.pem", f"{folder}/cert.pem"
    command = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=localhost"]
    command += ["-addext", "subjectAltName=DNS:localhost", "-keyout", key, "-out", certificate]
    try:
        subprocess.run(command, check=True, capture_output=True)
    except (OSError, subprocess.CalledProcessError):
        return []
    return ["--tls-cert", certificate, "--tls-key", key]


def serve(arguments: list[str], certificate: str | None) -> subprocess.Popen:
    command = [RELEASE / "papilla-server", "--bind", f"{HOST}:{PORT}", "--log", "error", *arguments]
    service = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.DEVNULL)
    end = time.monotonic() + 60
    while time.monotonic() < end and service.poll() is None:
        try:
            stream = connect(trusting(certificate))
            stream.sendall(f"GET /readyz HTTP/1.1\r\nHost: {HOST}:{PORT}\r\nConnection: close\r\n\r\n".encode())
            if b" 200 " in stream.recv(64):
                return service
        except OSError:
            pass
        time.sleep(0.1)
    service.kill()
    sys.exit("papilla-server does not get ready")


def terminate_under(kind: str, certificate: str | None, service: subprocess.Popen) -> float:
    """Seconds from SIGTERM to the end of the service, beside floods of a kind."""
    with floods(kind, certificate):
        start = time.monotonic()
        service.terminate()
        try:
            service.wait(timeout=60)
        except subprocess.TimeoutExpired:
            service.kill()
        return time.monotonic() - start


# What the kinds of floods send, for the report.
KINDS = """| four clients send | which is |
|---|---|
| windows | frames of 4 x 4 pixels |
| whole maps | frames with the whole window of 128 x 128 pixels, as the session of 90 Hz sends them |
| pings, pongs; the same before the hello | control messages of WebSocket, in an open session or before its first message |
| hellos of 1 MB | first messages that are too long |
| pieces of nothing | a message in endless empty parts |
| `/v1/atlas.obj`, `/v1/presses/0/sed` | HTTP requests, one behind the other on one connection |
""".split("\n")


def limit_ms(row: dict) -> float:
    """Up to which the p99 of the judged session is sound."""
    return 2 * row["idle_p99_ms"] + (10 if row["kind"] in HARD else 5)


def markdown(found: dict) -> str:
    """The report of a run (docs/reports/neighbours.md)."""
    rows = found["rows"]
    sound, lost = sum(row["sound"] for row in rows), sum(row["lost"] for row in rows)
    quick = sum(row["p99_ms"] <= limit_ms(row) for row in rows)
    lines = [
        "# A neighbour beside floods",
        "",
        "**Question.** Does a well-behaved session notice other clients that flood the service? The",
        "[glossary](../glossary.md) explains terms.",
        "",
        f"**What it means.** It lost {lost or 'no'} frames beside these floods. Its round trips were within their limit beside",
        f"{quick} of {len(rows)} ([first table](#a-neighbour-beside-floods)).",
        "",
        f"**Method.** One session sends {RATE_HZ} frames a second, each with a window of 128 x 128 pixels in samples",
        "of 8 bits, and is answered by the network `nano`. Meanwhile a balancer asks for `/healthz` on",
        "connections of its own. Beside them four clients send without a pause, all of them the same: a",
        "*flood*. The next table has the kinds of floods. Just before each flood the session is measured",
        "beside four others that send nothing (*idle*). A flood is *sound* if three conditions are met:",
        "",
        "- the session loses no frame;",
        "- each `/healthz` is answered within 100 ms;",
        "- the p99 of the session's round trips is within its limit: twice the p99 beside idle sessions, and 5 ms more. For",
        "  clients whose frames are hard to solve the limit has 10 ms in place of 5.",
        "",
        "```sh",
        "tests/soak/run --hostile --markdown docs/reports/neighbours.md",
        "```",
        "",
        *KINDS,
        f"Measured on {time.strftime('%Y-%m-%d')} on {processor()}, which the service, the flooding clients and the",
        f"session of {RATE_HZ} Hz share. Times in ms. *p50*, *p99* and *greatest* are of the round trips of the session",
        f"beside the flood. **{sound} of {len(rows)} are sound.**",
        "",
        "| transport | four clients send | taken by the service, MB/s | idle p99 | p50 | p99 | greatest | `/healthz`, greatest | lost | sound |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        cells = [row["transport"], row["kind"], row["sent_mb_per_s"], row["idle_p99_ms"], row["p50_ms"], row["p99_ms"]]
        cells += [row["max_ms"], row["health_max_ms"], row["lost"], "yes" if row["sound"] else "**no**"]
        lines.append(f"| {' | '.join(map(str, cells))} |")
    lines += [
        "",
        "**Ending.** Beside four clients that send windows without a pause, the service got SIGTERM. It has to",
        "end within 17 s, with exit code 0:",
        "",
        "| transport | ended after, s | exit code |",
        "|---|---|---|",
        *(f"| {row['transport']} | {row['end_s']} | {row['exit_code']} |" for row in found["ends"]),
    ]
    return "\n".join([*lines, *found["notes"], ""])


def run(minutes: float) -> dict:
    """All kinds in turn, plain and over TLS; `sound` says whether every one held."""
    rows, ends, notes = [], [], []
    kinds = [*FLOODS, *REQUESTS, *HARD]
    with tempfile.TemporaryDirectory() as folder:
        tls = certificate_in(folder)
        if not tls:
            notes.append("TLS left out: there is no openssl to make a certificate")
        for transport in ["plain", "tls"][: 2 if tls else 1]:
            arguments = tls if transport == "tls" else []
            certificate = arguments[1] if arguments else None
            seconds = max(3.0, 60 * minutes / (2 if tls else 1) / (2 * len(kinds)))
            service = serve(arguments, certificate)
            try:
                for kind in kinds:
                    idle = beside(IDLE, certificate, seconds)
                    row = {"transport": transport, **beside(kind, certificate, seconds)}
                    row["idle_p99_ms"] = idle["p99_ms"]
                    row["sound"] = (
                        row["lost"] == 0
                        and row["p99_ms"] <= limit_ms(row)
                        and row["health_max_ms"] <= 100
                    )
                    rows.append(row)
                    print(row, file=sys.stderr)
                took = terminate_under("windows", certificate, service)
                ends.append({"transport": transport, "end_s": round(took, 2), "exit_code": service.returncode})
            finally:
                service.kill()
                service.wait()
    # 15 s is the drain's own limit.
    sound = all(row["sound"] for row in rows) and all(row["end_s"] <= 17 and row["exit_code"] == 0 for row in ends)
    return {"rows": rows, "ends": ends, "notes": notes, "sound": sound}
