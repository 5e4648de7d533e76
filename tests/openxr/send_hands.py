#!/usr/bin/env python3
"""Moves both hands of Monado's remote driver, so that an OpenXR runtime without a headset tracks something.

The driver (configuration `remote`) listens on TCP port 4242 and makes a hand of the place of each wrist and
of five numbers that say how far the fingers are curled. A packet has 376 bytes, little-endian:

    8     "mndrmt3" and a zero
    96    two views of 48: four angles and a pose, not used here
    28    head: quaternion x, y, z, w, then x, y, z in m
    4     1 if the views are used, three zeros
    120   left hand, then 120 right hand, each:
          28 pose of the wrist, 12 velocity, 12 angular velocity, 20 curl of little, ring, middle, index
          finger and thumb (0 straight, 1 curled), 32 triggers and sticks, 1 whether the hand is tracked,
          1 whether the controller is, 14 buttons

Frame: Y up, metres, the floor at 0; a hand without a turn points along -Z, palm down. Needs nothing but
Python 3; looks for the driver again when that is gone.

    send_hands.py SECONDS [--host 127.0.0.1] [--port 4242] [--apart 0.1] [--closed 0.5] [--hidden]
"""

import argparse
import math
import socket
import struct
import time

HEADER = b"mndrmt3\0"
STRAIGHT = (0.0, 0.0, 0.0, 1.0)
HEAD_M = (0.0, 1.6, 0.0)
RATE_HZ = 90.0
# Open until the hand is measured and an object is put into it, then closing and opening.
OPEN_S, CYCLE_S = 3.0, 4.0
# A hand that is at ease.
OPEN_CURL = 0.15


def pose(place, turn=STRAIGHT):
    return struct.pack("<7f", *turn, *place)


def hand(place, curl, is_seen):
    # The thumb comes to meet the fingers.
    curls = [curl, curl, curl, curl, 0.6 * curl]
    packed = pose(place) + struct.pack("<6f5f8f", *[0.0] * 6, *curls, *[0.0] * 8)
    return packed + struct.pack("<2B14x", is_seen, is_seen)


def packet(left, right):
    head = bytes(96) + pose(HEAD_M) + bytes(4)
    packed = HEADER + head + left + right
    assert len(packed) == 376, len(packed)
    return packed


def closed(seconds):
    """How far the hands are closed at a time: 0 to 1."""
    if seconds < OPEN_S:
        return 0.0
    return 0.5 - 0.5 * math.cos(2.0 * math.pi * (seconds - OPEN_S) / CYCLE_S)


def send(connection, given, begun, end):
    while time.monotonic() < end:
        seconds = time.monotonic() - begun
        curl = OPEN_CURL + (given.closed - OPEN_CURL) * closed(seconds)
        sides = [hand((x, 1.2, -0.3), curl, not given.hidden) for x in (-given.apart, given.apart)]
        connection.sendall(packet(*sides))
        time.sleep(1.0 / RATE_HZ)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("seconds", type=float, help="end after so many seconds")
    parser.add_argument("--host", default="127.0.0.1")
    parser.add_argument("--port", type=int, default=4242)
    parser.add_argument("--apart", type=float, default=0.1, help="half the way between the wrists, m")
    parser.add_argument("--closed", type=float, default=0.5, help="curl of the closed hands, 0 to 1")
    parser.add_argument("--hidden", action="store_true", help="both hands are out of sight")
    given = parser.parse_args()
    begun = time.monotonic()
    end = begun + given.seconds
    while time.monotonic() < end:
        try:
            with socket.create_connection((given.host, given.port), 1.0) as connection:
                send(connection, given, begun, end)
        except OSError:
            time.sleep(0.1)


if __name__ == "__main__":
    main()
