"""The example `oscillator` once more, from PROTOCOL.md alone: it speaks TCP to `rockfall bridge --listen`.

    python3 oscillator.py HOST PORT
"""
import socket
import struct
import sys

MASS, SPRING = 20.0, 2e5
END, SCENE, MESSAGE, REQUEST, ANSWER, HEARTBEAT = range(6)


def u32(x):
    return struct.pack("<I", x)


def u64(x):
    return struct.pack("<Q", x)


def f64(*x):
    return struct.pack(f"<{len(x)}d", *x)


def text(x):
    return u64(len(x)) + x.encode()


def listed(*items):
    return u64(len(items)) + b"".join(items)


def field(name, sampling):
    return text(name) + struct.pack("<5I", 3, 0, sampling, 1, 0)


def message(variant, *parts):
    return b"\x03" + u32(variant) + b"".join(parts)


NONE = u64(0)
HELLO = message(
    0, text("oscillator"), NONE, text(""), b"\x01" + f64(0.0), listed(field("force", 2)),
    listed(field("displacement", 0), field("velocity", 0)), f64(1e-3), NONE,
)
MESH = text("") + listed(f64(0.0), f64(0.0), f64(0.0)) + NONE + NONE + NONE + listed(f64(MASS)) + NONE
GAUGE = text("oscillator_uz") + text("m") + u32(0) + b"\x01"
READY = message(2, MESH, listed(GAUGE), listed(*[f64(0.0)] * 9), NONE, NONE, NONE)
STATISTICS = message(4, NONE, NONE, b"\x00", b"\x00", NONE, NONE, f64(0.0, 0.0), u64(0), NONE)
ANSWERS = {0: HELLO, 1: READY, 3: STATISTICS, 4: STATISTICS}


def exactly(connection, count):
    data = b""
    while len(data) < count:
        more = connection.recv(count - len(data))
        if not more:
            sys.exit("the bridge has closed the connection")
        data += more
    return data


def main():
    connection = socket.create_connection((sys.argv[1], int(sys.argv[2])))
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    connection.sendall(b"rockfall" + u32(1) + u32(0))
    assert exactly(connection, 12) == b"rockfall" + u32(1)

    def send(kind, payload):
        connection.sendall(u32(len(payload)) + bytes([kind]) + payload)

    committed = trial = (0.0, 0.0)
    while True:
        length, kind = struct.unpack("<IB", exactly(connection, 5))
        payload = exactly(connection, length)
        if kind == END:
            sys.exit(payload.decode())
        elif kind == MESSAGE:
            assert payload[0] == 3, payload[0]
            variant = struct.unpack_from("<I", payload, 1)[0]
            send(MESSAGE, ANSWERS[variant])
            if variant == 3:
                return
        elif kind == REQUEST:
            run, sequence, window, iteration, command, start, h, selection = struct.unpack_from("<3Q2I2dI", payload)
            force = struct.unpack_from("<3d", payload, 64)
            if command == 2:
                committed = trial
            u, v = committed
            middle = u + 0.5 * h * v
            v1 = v + h * (force[2] - SPRING * middle) / MASS
            trial = (middle + 0.5 * h * v1, v1)
            echo = struct.pack("<3Q2I2d4I", run, sequence, window, iteration, 1, start, h, selection, 0, 0, 0)
            z = trial[0]
            send(ANSWER, echo + f64(0.0, 0.0, z, 0.0, 0.0, v1, z, z, z))


main()
