"""A headless browser, driven over a pipe in its DevTools protocol; nothing but the standard library."""

import base64
import json
import os
import select
import subprocess
import time

PATIENCE_S = 180


class Browser:
    """One page in one browser."""

    def __init__(self, program, folder, size=(1280, 800), pixel_ratio=1):
        to_browser, self._write = os.pipe()
        self._read, from_browser = os.pipe()

        def hand_over():
            # Drawing by the processor takes all of it; the run that it shows comes first.
            os.nice(10)
            # The browser reads commands from 3 and writes answers to 4.
            reads, writes = os.dup(to_browser), os.dup(from_browser)
            os.dup2(reads, 3)
            os.dup2(writes, 4)

        arguments = [
            program, "--headless=new", "--no-sandbox", "--remote-debugging-pipe", "--use-gl=angle",
            "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--hide-scrollbars",
            "--no-first-run", "--disable-extensions", "--disable-background-networking",
            "--ignore-certificate-errors", f"--window-size={size[0]},{size[1]}",
            f"--user-data-dir={folder}/browser", "about:blank",
        ]
        self._log = open(f"{folder}/browser.log", "ab")
        self._process = subprocess.Popen(
            arguments, preexec_fn=hand_over, close_fds=False, stdin=subprocess.DEVNULL,
            stdout=self._log, stderr=self._log, env={**os.environ, "HOME": folder})
        os.close(to_browser)
        os.close(from_browser)
        self._number, self._rest, self.said = 0, b"", []
        target = self._ask("Target.createTarget", {"url": "about:blank"})["targetId"]
        attached = self._ask("Target.attachToTarget", {"targetId": target, "flatten": True})
        self._session = attached["sessionId"]
        for domain in ("Page", "Runtime"):
            self.ask(f"{domain}.enable")
        self.ask("Emulation.setDeviceMetricsOverride", {
            "width": size[0], "height": size[1], "deviceScaleFactor": pixel_ratio, "mobile": False})

    def _message(self, until):
        while b"\0" not in self._rest:
            left = until - time.monotonic()
            if left <= 0 or not select.select([self._read], [], [], left)[0]:
                raise TimeoutError("the browser does not answer")
            piece = os.read(self._read, 1 << 16)
            if not piece:
                raise ConnectionError("the browser has gone")
            self._rest += piece
        text, self._rest = self._rest.split(b"\0", 1)
        return json.loads(text)

    def _ask(self, method, parameters=None, session=None):
        self._number += 1
        asked = {"id": self._number, "method": method, "params": parameters or {}}
        if session:
            asked["sessionId"] = session
        os.write(self._write, json.dumps(asked).encode() + b"\0")
        until = time.monotonic() + PATIENCE_S
        while True:
            message = self._message(until)
            if message.get("method") in ("Runtime.consoleAPICalled", "Runtime.exceptionThrown"):
                self.said.append(json.dumps(message["params"])[:600])
            if message.get("id") == self._number:
                if "error" in message:
                    raise RuntimeError(f"{method}: {message['error']}")
                return message["result"]

    def ask(self, method, parameters=None):
        """Asks something of the page."""
        return self._ask(method, parameters, self._session)

    def before_every_page(self, script):
        """A script that runs before those of every page."""
        self.ask("Page.addScriptToEvaluateOnNewDocument", {"source": script})

    def open(self, address):
        """Opens an address."""
        told = self.ask("Page.navigate", {"url": address})
        if "errorText" in told:
            raise RuntimeError(f"{address}: {told['errorText']}")

    def value(self, expression):
        """What an expression is on the page; promises are waited for."""
        told = self.ask("Runtime.evaluate", {
            "expression": expression, "returnByValue": True, "awaitPromise": True, "userGesture": True})
        if "exceptionDetails" in told:
            raise RuntimeError(f"{expression}: {told['exceptionDetails'].get('exception', told)}")
        return told["result"].get("value")

    def until(self, expression, patience_s=PATIENCE_S):
        """Waits until an expression is true."""
        end = time.monotonic() + patience_s
        while time.monotonic() < end:
            if self.value(expression):
                return
            time.sleep(0.05)
        state = self.value("window.softgrasp && JSON.stringify({...softgrasp.figures, roundTrips: 0, latencies: 0})")
        raise TimeoutError(f"never true: {expression}\n  {state}\n  " + "\n  ".join(self.said[-5:]))

    def picture(self, file):
        """Writes a picture of the page."""
        data = self.ask("Page.captureScreenshot", {"format": "png"})["data"]
        with open(file, "wb") as out:
            out.write(base64.b64decode(data))

    def close(self):
        """Ends the browser."""
        self._process.terminate()
        try:
            self._process.wait(10)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._log.close()
        os.close(self._write)
        os.close(self._read)
