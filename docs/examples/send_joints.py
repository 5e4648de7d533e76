#!/usr/bin/env python3
"""Sends the joints of a hand, as lines of JSON, to a program that reads docs/joints.md.

Without --file the hand is made here: it closes and opens. With --file the hand takes the poses of a
JSON file of WebXR matrices ({"poses": {name: {"joints": {joint: {"matrix": [16 numbers]}}}}}) one
after the other. Needs nothing but Python 3.

    send_joints.py                              datagrams to 127.0.0.1:7879, 60 a second
    send_joints.py --tcp --port 7879 --rate 90  over a connection
    send_joints.py --webxr --left               25 joints instead of 26, a left hand
    send_joints.py --file poses.json            recorded poses
    send_joints.py --print --count 1            one line on the screen, nothing is sent
"""

import argparse
import itertools
import json
import math
import socket
import sys
import time

WEBXR_NAMES = ["wrist", "thumb-metacarpal", "thumb-phalanx-proximal", "thumb-phalanx-distal",
               "thumb-tip"] + [
    f"{finger}-finger-{bone}"
    for finger in ("index", "middle", "ring", "pinky")
    for bone in ("metacarpal", "phalanx-proximal", "phalanx-intermediate", "phalanx-distal", "tip")
]

# A hand of 185 mm, in mm: X toward the little finger, Y along the palm, Z out of its back.
KNUCKLES = [(-21.1, 82.7), (0.0, 82.5), (17.3, 75.7), (33.8, 68.1)]
FAN_DEG = [7.6, 0.0, -6.2, -15.9]
FINGER_BONES = [(44.2, 24.9, 21.8), (49.6, 29.2, 23.7), (45.9, 28.5, 23.6), (36.4, 20.1, 21.9)]
WRIST = (0.0, -20.3, 0.0)
THUMB_BASE = (-27.0, 11.1, -10.1)
THUMB_BONES = (51.3, 35.1, 30.4)
THUMB_OPEN = ((-0.47, 0.83, -0.30), (-0.44, 0.86, -0.26), (-0.42, 0.88, -0.22))
THUMB_CLOSED = ((-0.25, 0.73, -0.64), (0.25, 0.77, -0.59), (0.66, 0.66, -0.36))


def along(start, direction, length):
    norm = math.sqrt(sum(d * d for d in direction))
    return tuple(s + d / norm * length for s, d in zip(start, direction))


def between(a, b, share):
    return tuple(x + (y - x) * share for x, y in zip(a, b))


def finger(number, closed):
    """Knuckle, two joints and tip of one finger, in mm; closed is 0 (flat) to 1 (fist)."""
    fan = math.radians(FAN_DEG[number])
    places = [KNUCKLES[number] + (0.0,)]
    bend = 0.0
    for bone, flexion in zip(FINGER_BONES[number], (1.2, 1.5, 0.9)):
        bend += flexion * closed
        ahead = math.cos(bend)
        direction = (-math.sin(fan) * ahead, math.cos(fan) * ahead, -math.sin(bend))
        places.append(along(places[-1], direction, bone))
    return places


def made_hand(closed):
    """The 26 joints of OpenXR, in mm."""
    thumb = [THUMB_BASE]
    for bone, before, after in zip(THUMB_BONES, THUMB_OPEN, THUMB_CLOSED):
        thumb.append(along(thumb[-1], between(before, after, closed), bone))
    joints = [WRIST] + thumb
    for number in range(4):
        places = finger(number, closed)
        joints += [between(WRIST, places[0], 0.37)] + places
    palm = between(joints[10], joints[11], 0.5)
    return [palm] + joints


def made_joints(seconds, left, at):
    """The made hand in the world: metres, Y up, the fingers toward -Z."""
    closed = 0.5 - 0.5 * math.cos(2.0 * math.pi * seconds / 4.0)
    side = -1.0 if left else 1.0
    return [
        [round(at[0] + side * x * 1e-3, 6), round(at[1] + z * 1e-3, 6), round(at[2] - y * 1e-3, 6)]
        for x, y, z in made_hand(closed)
    ]


def poses_of_file(path):
    """Every pose of the file as 25 matrices, columns one after the other."""
    with open(path, encoding="utf-8") as file:
        poses = json.load(file)["poses"]
    return [[pose["joints"][name]["matrix"] for name in WEBXR_NAMES] for pose in poses.values()]


def recorded_joints(poses, seconds, at):
    """The pose of this second, moved to where the hand is to be."""
    pose = poses[int(seconds) % len(poses)]
    return [m[:12] + [m[12] + at[0], m[13] + at[1], m[14] + at[2], m[15]] for m in pose]


def arguments():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--host", default="127.0.0.1")
    parser.add_argument("--port", type=int, default=7879)
    parser.add_argument("--tcp", action="store_true", help="a connection instead of datagrams")
    parser.add_argument("--rate", type=float, default=60.0, help="records a second")
    parser.add_argument("--count", type=int, help="end after so many records")
    parser.add_argument("--left", action="store_true", help="a left hand (the made one)")
    parser.add_argument("--webxr", action="store_true", help="25 joints, without the palm")
    parser.add_argument("--file", help="JSON file of WebXR poses; the hand is a left one unless "
                        "--right is given")
    parser.add_argument("--right", action="store_true", help="the file's hand is a right one")
    parser.add_argument("--at", type=float, nargs=3, default=[0.0, 0.1, 0.1],
                        metavar=("X", "Y", "Z"), help="where the hand is, m")
    parser.add_argument("--print", action="store_true", help="print the lines, send nothing")
    given = parser.parse_args()
    if not given.rate > 0.0:
        parser.error("--rate must be more than 0")
    return given


def sender(given):
    """A function that sends one line."""
    if given.print:
        return lambda line: sys.stdout.write(line.decode())
    if given.tcp:
        connection = socket.create_connection((given.host, given.port))
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return connection.sendall
    family, _, _, _, address = socket.getaddrinfo(
        given.host, given.port, type=socket.SOCK_DGRAM)[0]
    datagrams = socket.socket(family, socket.SOCK_DGRAM)
    return lambda line: datagrams.sendto(line, address)


def main():
    given = arguments()
    poses = poses_of_file(given.file) if given.file else None
    left = not given.right if poses else given.left
    send = sender(given)
    start = time.monotonic()
    frames = itertools.count() if given.count is None else range(given.count)
    for frame in frames:
        seconds = frame / given.rate
        time.sleep(max(0.0, start + seconds - time.monotonic()))
        if poses:
            joints = recorded_joints(poses, seconds, given.at)
        else:
            joints = made_joints(seconds, left, given.at)
            joints = joints[1:] if given.webxr else joints
        record = {"hand": "left" if left else "right", "time": round(seconds, 6), "frame": frame,
                  "joints": joints}
        try:
            send(json.dumps(record, separators=(",", ":")).encode() + b"\n")
        except ConnectionRefusedError:
            # A datagram found nobody who listens; somebody may later.
            if given.tcp:
                raise


if __name__ == "__main__":
    try:
        main()
    except (KeyboardInterrupt, BrokenPipeError):
        pass
    except OSError as error:
        sys.exit(f"send_joints.py: {error}")
