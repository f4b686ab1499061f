"""palpate-ros beside Fast DDS, the default of ROS 2: fast_dds.cpp, which test/run compiles where Fast DDS is installed."""

import os
import queue
import subprocess
import threading
import time

import pytest
from messages import *
from peer import PATIENCE, Node, until

PEER = os.environ.get("PALPATE_FAST_DDS")
MODEL = os.environ["PALPATE_MODEL"]

pytestmark = pytest.mark.skipif(not PEER, reason="Fast DDS is not installed")


class FastDds:
    """A participant of Fast DDS beside a node."""

    def __init__(self, node):
        self.base = node.base
        self.came = []

    def __enter__(self):
        self.process = subprocess.Popen([PEER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1)
        self.lines = queue.SimpleQueue()
        threading.Thread(target=lambda: [self.lines.put(line.split()) for line in self.process.stdout], daemon=True).start()
        return self

    def __exit__(self, *_):
        self.process.stdin.close()
        assert self.process.wait(PATIENCE) == 0

    def heard(self, what):
        """The next line that begins so; messages that come before it are kept."""
        while True:
            first, *rest = self.lines.get(timeout=PATIENCE)
            if first == what:
                return rest
            self.came.append(rest)

    def tell(self, *words):
        print(*words, file=self.process.stdin, flush=True)

    def ask(self, *words):
        self.tell(*words)
        return int(self.heard("made")[0])

    def make(self, what, name, kind, latched=False, prefix="rt", suffix=""):
        made = self.ask(what, f"{prefix}{self.base}/{name}{suffix}", kind.__idl_typename__.replace(".", "::"), int(latched))
        until(lambda: self.ask("matched", what, made), f"Fast DDS does not find {name}")
        return made

    def write(self, writer, message):
        self.tell("write", writer, encoded(message))

    def take(self, reader, kind):
        """The next message of a reader, and the number of the request that it is a reply to."""
        while True:
            for index, (of, number, text) in enumerate(self.came):
                if int(of) == reader:
                    del self.came[index]
                    return kind.deserialize(bytes.fromhex(text)), int(number)
            self.came.append(self.heard("came"))


def encoded(message):
    return message.serialize().hex()


def test_fast_dds_finds_the_node_and_gets_a_verdict_for_each_of_2000_touches():
    with Node(MODEL) as node, FastDds(node) as peer:
        verdicts = peer.make("reader", "verdict", Verdict, latched=True)
        before, _ = peer.take(verdicts, Verdict)
        assert before.touch == 0 and len(before.objects) == 10
        touches = peer.make("writer", "touch", Touch)
        ended = 0
        for number in range(1, 2001):
            touch = Touch([0.001 * (number % 7), 0.0, NAN if number % 5 == 0 else 0.002])
            peer.write(touches, touch)
            verdict, _ = peer.take(verdicts, Verdict)
            assert abs(sum(verdict.posteriors) - 1) < 1e-9 and verdict.refused == ""
            ended += verdict.verdict != "undecided"
        assert ended > 10 and node.stop() == 0


def test_replies_of_a_service_are_to_the_request_of_fast_dds():
    with Node(MODEL) as node, FastDds(node) as peer:
        replies = peer.make("reader", "reset", ResetResponse, prefix="rr", suffix="Reply")
        requests = peer.make("writer", "reset", ResetRequest, prefix="rq", suffix="Request")
        for request, success in [
            (ResetRequest(["bowl", "fork"], [3, 1]), True),
            (ResetRequest(["knife"], [1]), False),
            (ResetRequest(), True),
        ]:
            number = peer.ask("request", requests, replies, encoded(request))
            reply, to = peer.take(replies, ResetResponse)
            assert (reply.success, to) == (success, number), reply
            assert success or "knife" in reply.message


def test_switches_that_fast_dds_publishes_become_a_touch():
    with Node(MODEL) as node, FastDds(node) as peer:
        measured = peer.make("reader", "measured_touch", Touch)
        verdicts = peer.make("reader", "verdict_text", String, latched=True)
        peer.take(verdicts, String)
        switches = [peer.make("writer", f"switch/{name}", Bool) for name in ["first", "middle", "last"]]
        for switch in switches:
            peer.write(switch, Bool(True))
            time.sleep(0.03)
        for switch in switches:
            peer.write(switch, Bool(False))
        touch, _ = peer.take(measured, Touch)
        # When they were published, 30 ms or more after each other.
        assert touch.times[0] == 0 and min(b - a for a, b in zip(touch.times, touch.times[1:])) > 0.029
        verdict, _ = peer.take(verdicts, String)
        assert "after 1 touch" in verdict.data
