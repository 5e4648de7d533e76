"""Looks at the page of a run: flat, in a fake headset, and after a loss. See run.sh."""

import json
import os
import re
import signal
import struct
import subprocess
import sys
import time
import zlib
from pathlib import Path

from browser import Browser

HERE = Path(__file__).parent
STRAWBERRY = ["--object", "strawberry", "--nodes", "1000"]
# Edge of the cube that two palms lift, m.
EDGE_M = 0.06
CUBE = ["--object", "cube", "--nodes", "343", "--object-size", str(EDGE_M)]


def say(text):
    print(f"xr: {text}", flush=True)


class Run:
    """A run that serves a page."""

    def __init__(self, client, folder, *options):
        self.log = Path(folder) / f"run-{time.monotonic_ns()}.log"
        with open(self.log, "wb") as log:
            self.process = subprocess.Popen(
                [client, "run", "--headless", "--xr", "127.0.0.1:0", *options],
                stdin=subprocess.DEVNULL, stdout=log, stderr=log, cwd=folder)
        end = time.monotonic() + 60
        while True:
            told = re.search(r"the page is at (http\S+)", self.said())
            if told:
                self.address = told.group(1)
                return
            if time.monotonic() > end or self.process.poll() is not None:
                raise RuntimeError(f"no page:\n{self.said()}")
            time.sleep(0.05)

    def said(self):
        return self.log.read_text(errors="replace")

    def end(self):
        """Ends the run as Ctrl-C does; its exit code."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        try:
            return self.process.wait(60)
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise


def pixels(file):
    """Width, height and rows of a PNG picture of eight bits a channel without interlacing."""
    data, at, packed = Path(file).read_bytes(), 8, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        piece = data[at + 8:at + 8 + length]
        if kind == b"IHDR":
            width, height, _, colour = struct.unpack(">IIBB", piece[:10])
        elif kind == b"IDAT":
            packed += piece
        at += 12 + length
    each = {2: 3, 6: 4}[colour]
    raw, rows, before = zlib.decompress(packed), [], bytearray(width * each)
    for y in range(height):
        begin = y * (width * each + 1)
        filtered, row = raw[begin], bytearray(raw[begin + 1:begin + 1 + width * each])
        for i in range(len(row)):
            left = row[i - each] if i >= each else 0
            up, corner = before[i], before[i - each] if i >= each else 0
            if filtered == 1:
                row[i] = (row[i] + left) & 255
            elif filtered == 2:
                row[i] = (row[i] + up) & 255
            elif filtered == 3:
                row[i] = (row[i] + (left + up) // 2) & 255
            elif filtered == 4:
                p = left + up - corner
                a, b, c = abs(p - left), abs(p - up), abs(p - corner)
                row[i] = (row[i] + (left if a <= b and a <= c else up if b <= c else corner)) & 255
        rows.append([tuple(row[each * x:each * x + 3]) for x in range(width)])
        before = row
    return width, height, rows


# Times that the hand tries to lift.
LIFTS_MAX = 5


def is_red(pixel):
    """Whether a pixel is as red as a strawberry."""
    r, g, b = pixel
    return r > 90 and r > 1.9 * g and r > 1.9 * b


def share_of_red(rows, columns):
    """Share of the pixels of some columns that are as red as a strawberry."""
    seen = [pixel for row in rows[::3] for pixel in row[columns]]
    return sum(map(is_red, seen)) / len(seen)


def eyes(path):
    """Share of red pixels in either half of a picture in stereo."""
    width, _, rows = pixels(path)
    halves = {"left": slice(0, width // 2), "right": slice(width // 2, width)}
    return {name: share_of_red(rows, columns) for name, columns in halves.items()}


def check(holds, what):
    if not holds:
        raise AssertionError(what)


def flat(client, program, folder, pictures):
    """A browser without a headset sees a scripted hand squeeze and lift."""
    run = Run(client, folder, *STRAWBERRY, "--hand", "scripted:lift", "--shading", "plain")
    browser = Browser(program, folder)
    try:
        browser.open(run.address)
        browser.until("window.softgrasp && softgrasp.figures.drawn > 3 && softgrasp.scene.picture")
        browser.until("[...softgrasp.scene.textures.values()].every((t) => t)")
        browser.until("softgrasp.figures.status.height_mm > 25 && softgrasp.figures.status.deforming")
        browser.picture(f"{pictures}/flat.png")
        width, height, rows = pixels(f"{pictures}/flat.png")
        red = share_of_red(rows, slice(0, width))
        check(red > 0.01, f"there is no strawberry in the picture: {red:.4f} of it is red")
        # A drag turns the view.
        before = browser.value("softgrasp.eye.now.yaw")
        for kind, x in (("mousePressed", 640), ("mouseMoved", 700), ("mouseReleased", 700)):
            browser.ask("Input.dispatchMouseEvent", {
                "type": kind, "x": x, "y": 420, "button": "left", "buttons": 1, "clickCount": 1})
        check(browser.value("softgrasp.eye.now.yaw") != before, "a drag does not turn the view")
        browser.value("document.getElementById('colours').click()")
        browser.until("softgrasp.figures.status.shading !== 'plain' && !document.getElementById('legend').hidden")
        browser.until("softgrasp.scene.picture.coloured")
        browser.picture(f"{pictures}/flat-coloured.png")
        told = browser.value("document.getElementById('figures').textContent")
        say(f"flat: {told}")
        check(browser.value("softgrasp.figures.faults") == [], browser.value("softgrasp.figures.faults"))
        browser.value("softgrasp.stream && document.querySelector('#exit-dialog').showModal()")
        browser.value("document.querySelector('#exit-dialog button[value=exit]').click()")
        browser.until("document.getElementById('state').textContent.includes('the run')", 30)
        check(run.process.wait(60) == 0, f"the run ended with {run.process.returncode}")
    finally:
        browser.close()
        run.end()


def lift(browser):
    """Lets the tracked hands lift the object. Where the machine is so busy that it slips, the menu of the
    board puts it home, the hands begin anew, and that is told."""
    is_over = "window.fakeSession.isOver"
    status = "softgrasp.figures.status"
    # What both eyes draw has risen as well, and not only what the run tells of it.
    lying_m = browser.value("softgrasp.scene.picture.pose[1]")
    is_up = f"{status}.height_mm > 15 && softgrasp.scene.picture.pose[1] > {lying_m} + 0.012"
    for _ in range(LIFTS_MAX):
        browser.value("window.fakeSession.seconds = 0; window.fakeHandMoves = true")
        # However slowly pictures come: the hand moves with them. Fingers that have just touched may lose it for
        # a moment, so only the end of the way tells.
        browser.until(f"(window.hasRisen ||= {is_up}) || {is_over}", 400)
        if browser.value("window.hasRisen"):
            return
        told = browser.value(f"JSON.stringify({status})")
        say(f"the object slipped; it is put home and lifted once more: {told}")
        browser.value("window.fakeHandMoves = false; window.fakeSession.seconds = 0")
        browser.value("softgrasp.headset.board.press('return-home')")
        browser.until(f"Math.abs({status}.height_mm) < 4 && !{status}.deforming", 30)
    raise AssertionError(f"the object slipped {LIFTS_MAX} times")


def picture_of_scene(browser, path):
    """A picture of what is drawn alone: the page's sentences would lie over it, with red bars of their own."""
    # The page's policy of contents lets no style in by an element.
    browser.value(
        "window.alone = new CSSStyleSheet(); window.alone.replaceSync("
        "'body * { visibility: hidden !important } canvas { visibility: visible !important }');"
        "document.adoptedStyleSheets = [...document.adoptedStyleSheets, window.alone];"
        "window.isAlone = false; requestAnimationFrame(() => requestAnimationFrame(() => { window.isAlone = true })); 0")
    # The picture is the one that was drawn last: on a busy machine that is one with the sentences still.
    browser.until("window.isAlone")
    browser.picture(path)
    browser.value(
        "document.adoptedStyleSheets = document.adoptedStyleSheets.filter((sheet) => sheet !== window.alone); 0")


# Joints of a flat right hand in the order of WebXR: how far from the wrist toward the fingertips, and toward the
# thumb, m.
FLAT_HAND = [
    (0, 0), (0.025, 0.028), (0.055, 0.042), (0.080, 0.048), (0.100, 0.050),
    (0.030, 0.018), (0.095, 0.025), (0.138, 0.027), (0.163, 0.028), (0.183, 0.028),
    (0.030, 0.005), (0.095, 0.004), (0.141, 0.004), (0.170, 0.004), (0.191, 0.004),
    (0.030, -0.008), (0.090, -0.015), (0.133, -0.016), (0.160, -0.017), (0.180, -0.017),
    (0.030, -0.020), (0.082, -0.034), (0.115, -0.037), (0.135, -0.038), (0.153, -0.039)]
# Half the thickness of a hand, how far each palm presses into the cube, and where the hands begin: so far from the
# cube, above the table and behind the cube, m.
HALF_HAND_M, PRESS_M, APART_M, ABOVE_M, BEHIND_M = 0.011, 0.008, 0.05, 0.035, 0.085
LIFT_M = 0.06


def way(frame, first, last):
    """Gentle way from 0 to 1 between two frames."""
    t = min(max((frame - first) / (last - first), 0), 1)
    return t * t * (3 - 2 * t)


def palms():
    """Frames of two upright hands that press a cube between their palms and lift it, for the fake headset."""
    hands = {"right": [], "left": []}
    for frame in range(90):
        x = EDGE_M / 2 + HALF_HAND_M - PRESS_M + APART_M * (1 - way(frame, 10, 35))
        y = ABOVE_M + LIFT_M * way(frame, 40, 70)
        for side, sign in (("right", 1), ("left", -1)):
            joints = [(sign * x, y + up, BEHIND_M - ahead) for ahead, up in FLAT_HAND]
            hands[side].append([[round(1e4 * place) for place in joint] for joint in joints])
    return hands


def enter(browser, address, hands):
    """Opens the page and enters the fake headset with these hands, until both eyes see the run and them."""
    browser.before_every_page((HERE / "fake_headset.js").read_text())
    browser.before_every_page(f"window.fakeHands = {json.dumps(hands)};")
    browser.open(address)
    browser.until("window.softgrasp && softgrasp.figures.drawn > 3 && softgrasp.scene.picture")
    browser.until("[...softgrasp.scene.textures.values()].every((t) => t)")
    browser.until("softgrasp.figures.status.server === 'connected' && !softgrasp.figures.status.preparing")
    browser.until("!document.getElementById('enter').hidden")
    browser.value("document.getElementById('enter').click()")
    browser.until("softgrasp.figures.stereo > 10")
    browser.until(f"softgrasp.scene.picture.hands.length === {len(hands)}")
    check(browser.value("softgrasp.scene.picture.hands.every((hand) => softgrasp.scene.hands.has(hand.version))"),
          "a hand has no skin")


def two_hands(client, program, folder, pictures):
    """Both tracked hands of a headset lift a cube between their palms."""
    run = Run(client, folder, *CUBE, "--hand", "xr", "--grasp", "contact", "--shading", "plain")
    browser = Browser(program, folder, (960, 480), 0.5)
    try:
        enter(browser, run.address, palms())
        check(browser.value("new Set(softgrasp.scene.picture.hands.map((hand) => hand.version)).size") == 2,
              "both hands have one skin")
        lift(browser)
        browser.picture(f"{pictures}/two-hands.png")
        # Where the palms are drawn: a bone is a dual quaternion, its turn and half of its shift times the turn.
        drawn = json.loads(browser.value(
            "JSON.stringify(softgrasp.scene.picture.hands.map(({bones: [x, y, z, w, dx, dy, dz, dw]}) =>"
            "2 * (dx * w - dw * x + dz * y - dy * z)))"))
        say(f"two hands: palms drawn at {drawn[0]:.3f} and {drawn[1]:.3f} m")
        check(drawn[0] > 0.02 and drawn[1] < -0.02, "a hand is drawn on the wrong side")
        check(browser.value("softgrasp.figures.faults") == [], browser.value("softgrasp.figures.faults"))
        check(run.end() == 0, f"the run ended with {run.process.returncode}:\n{run.said()}")
    finally:
        browser.close()
        run.end()


def headset(client, program, folder, pictures):
    """The tracked hand of a headset lifts the strawberry; the connection is lost and comes back."""
    run = Run(client, folder, *STRAWBERRY, "--hand", "xr", "--grasp", "contact", "--shading", "plain")
    # The processor draws: with fewer pixels pictures come often enough for a hand that holds something.
    browser = Browser(program, folder, (960, 480), 0.5)
    try:
        enter(browser, run.address, {"right": json.loads((HERE / "lifting_hand.json").read_text())})
        picture_of_scene(browser, f"{pictures}/headset-before.png")
        for name, share in eyes(f"{pictures}/headset-before.png").items():
            say(f"{name} eye: {share} of it is as red as the strawberry")
            check(share > 0.001, f"the {name} eye sees no strawberry: {share:.5f} of it is red")
        lift(browser)
        # For people to look at: where pictures come slowly the fruit may have been let go again by then.
        browser.picture(f"{pictures}/headset.png")
        browser.value("window.fakeHandMoves = true")
        say("lost: the connection is cut")
        before = browser.value("softgrasp.stream.connections")
        browser.value("softgrasp.card.ask && softgrasp.headset.stream.socket.close()")
        browser.until(f"softgrasp.stream.connections > {before}", 30)
        pictures_before = browser.value("softgrasp.stream.pictures")
        browser.until(f"softgrasp.stream.pictures > {pictures_before} + 5", 30)
        told = browser.value(
            "JSON.stringify({stereo: softgrasp.figures.stereo, hands: softgrasp.stream.handsSent,"
            "pictures: softgrasp.stream.pictures, hand_to_picture_ms: softgrasp.median(softgrasp.figures.latencies)})")
        say(f"headset: {told}")
        figures = json.loads(told)
        check(figures["hands"] > 20 and figures["stereo"] > 20, "too few hands or pictures")
        check(figures["hand_to_picture_ms"] is not None, "no latency was measured")
        check(browser.value("softgrasp.figures.faults") == [], browser.value("softgrasp.figures.faults"))
        # The menu of the board: leave the headset.
        browser.value("softgrasp.headset.board.press('leave')")
        browser.until("!softgrasp.headset.isInside")
        check(run.end() == 0, f"the run ended with {run.process.returncode}:\n{run.said()}")
        check("from hand to picture" in run.said(), f"the run tells no latency:\n{run.said()}")
    finally:
        browser.close()
        run.end()


def main():
    client, folder, pictures = sys.argv[1:4]
    program = os.environ["BROWSER_PROGRAM"]
    for part in (flat, headset, two_hands):
        say(part.__doc__.split(";")[0].rstrip("."))
        part(client, program, folder, pictures)


if __name__ == "__main__":
    main()
