"""Serves copies of pages of `palpate view --port` to a browser, each with .ci/port.js in it, passes the serial port of an emulated
chip on to them, and ends with the browser's verdict. For .ci/port.

    port.py PAGES DATA [PLAYER IMAGE [NEW]]

PAGES has plain.html, model.html and other.html, and says.txt, what the program makes of the touches; DATA has touches-1.txt to
touches-3.txt, recorded-1.bin, recorded-2.bin and shown.json. With NEW, a directory, what the emulated chip says and what the page shows is written there. The address of the
pages is the first line of the output.
"""

import json
import pathlib
import re
import socket
import subprocess
import sys
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

pages, data = map(pathlib.Path, sys.argv[1:3])
player, image = (sys.argv[3:5] + [None, None])[:2]
new = pathlib.Path(sys.argv[5]) if len(sys.argv) > 5 else None
script = (pathlib.Path(__file__).parent / "port.js").read_text()
verdict = []
done = threading.Event()


def touches():
    def lines(file):
        return file.read_text().splitlines()

    return {"parts": [lines(data / f"touches-{part}.txt") for part in (1, 2, 3)], "says": lines(pages / "says.txt")}


class Chip:
    """An emulated chip whose serial port one can pull and plug in."""

    def __init__(self):
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.address = free.getsockname()
        where = f"{self.address[0]}:{self.address[1]}"
        self.player = subprocess.Popen([player, image, where], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        assert self.player.stdout.readline().startswith("the chip is at")
        self.line, self.sessions = None, []

    def open(self):
        self.line = socket.create_connection(self.address)
        self.sessions.append(bytearray())
        return self.line

    def pull(self):
        self.line.shutdown(socket.SHUT_RDWR)

    def touch(self, part):
        self.player.stdin.write(f"{data / f'touches-{part}.txt'}\n")
        self.player.stdin.flush()
        self.player.stdout.readline()

    def end(self):
        self.player.stdin.close()
        self.player.wait()


chip = Chip() if player else None


class Handler(BaseHTTPRequestHandler):
    def log_message(self, *_):
        pass

    def answer(self, body=b"", kind="application/octet-stream"):
        self.send_response(200)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def do_GET(self):
        name = self.path.split("?")[0].strip("/")
        # Relative to /page/KIND/CASE.
        name = re.sub(r"^page/\w+/(?=line$|.*\.)", "", name)
        if name == "":
            self.answer(f"<!DOCTYPE html><body><script>{script}</script>".encode(), "text/html; charset=utf-8")
        elif found := re.fullmatch(r"page/(\w+)/\w+", name):
            page = (pages / f"{found[1]}.html").read_text()
            page = page.replace("default-src 'none'", "default-src 'none'; connect-src 'self'")
            page = page.replace("<script>", '<script type="text/later">').replace("<head>", f"<head><script>{script}</script>")
            self.answer(page.encode(), "text/html; charset=utf-8")
        elif name == "touches.json":
            self.answer(json.dumps(touches()).encode())
        elif name == "line":
            self.pass_on()
        elif (data / name).is_file():
            self.answer((data / name).read_bytes())
        else:
            self.send_error(404)

    def pass_on(self):
        """From the chip, until its cable is pulled."""
        line = chip.open()
        said = chip.sessions[-1]
        self.send_response(200)
        self.send_header("Content-Type", "application/octet-stream")
        self.end_headers()
        try:
            while heard := line.recv(256):
                said.extend(heard)
                self.wfile.write(heard)
        except OSError:
            pass
        line.close()

    def do_POST(self):
        body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
        name = re.sub(r"^page/\w+/", "", self.path.strip("/"))
        if name == "line":
            chip.line.sendall(body)
        elif name == "pull":
            chip.pull()
        elif name.startswith("touch/"):
            chip.touch(int(name[-1]))
        elif name == "shown.json":
            self.keep(json.loads(body))
        elif name == "verdict":
            verdict.append(body.decode())
            done.set()
        self.answer()

    def keep(self, shown):
        if not new:
            return
        new.mkdir(parents=True, exist_ok=True)
        (new / "shown.json").write_text(json.dumps(shown, ensure_ascii=False) + "\n")
        for number, said in enumerate(chip.sessions, 1):
            (new / f"recorded-{number}.bin").write_bytes(said)


server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
server.daemon_threads = True
threading.Thread(target=server.serve_forever, daemon=True).start()
print(f"http://127.0.0.1:{server.server_port}/", flush=True)
ended = done.wait(420)
if chip:
    chip.end()
print(verdict[0] if ended else "WRONG: the browser gave no verdict")
sys.exit(0 if ended and "WRONG" not in verdict[0] else 1)
