"""A node under test, and a participant of another DDS implementation beside it."""

import os
import signal
import subprocess
import time

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

PATIENCE = float(os.environ.get("PALPATE_PATIENCE", 30))  # seconds until something that should happen counts as missing


def qos(reliable=True, latched=False, depth=1000):
    """The quality of service of a ROS 2 publisher or subscriber."""
    policies = [
        Policy.Reliability.Reliable(duration(seconds=10)) if reliable else Policy.Reliability.BestEffort,
        Policy.Durability.TransientLocal if latched else Policy.Durability.Volatile,
        Policy.History.KeepLast(depth),
    ]
    return Qos(*policies)


def until(condition, what):
    """Waits until the condition holds, and returns its value."""
    end = time.monotonic() + PATIENCE
    while not (value := condition()):
        assert time.monotonic() < end, f"after {PATIENCE} s: {what if isinstance(what, str) else what()}"
        time.sleep(0.005)
    return value


class Node:
    """palpate-ros, as a process."""

    def __init__(self, *arguments, namespace=""):
        self.base = f"{namespace}/palpate"
        command = [os.environ["PALPATE_ROS"], *map(str, arguments)]
        if namespace:
            command += ["--namespace", namespace]
        self.process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)

    def stop(self, how=signal.SIGINT):
        self.process.send_signal(how)
        return self.process.wait(PATIENCE)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
        self.process.communicate()


class Peer:
    """A participant of Cyclone DDS beside a node."""

    def __init__(self, node):
        self.participant = DomainParticipant(int(os.environ["ROS_DOMAIN_ID"]))
        self.base = node.base

    def topic(self, name, kind, prefix="rt", suffix=""):
        base = "" if name.startswith("/") else f"{self.base}/"
        return Topic(self.participant, f"{prefix}{base}{name}{suffix}", kind)

    def writer(self, name, kind, qos=qos(), **names):
        """A publisher that a subscriber of the node has found."""
        writer = DataWriter(self.participant, self.topic(name, kind, **names), qos=qos)
        until(writer.get_matched_subscriptions, f"nobody subscribes to {name}")
        return writer

    def reader(self, name, kind, qos=qos(), **names):
        """A subscriber that a publisher of the node has found."""
        reader = DataReader(self.participant, self.topic(name, kind, **names), qos=qos)
        until(reader.get_matched_publications, f"nobody publishes {name}")
        return reader

    def latched(self, name, kind):
        """A subscriber that has got the message of before the first touch: the node has found it, and all opened before it."""
        reader = self.reader(name, kind, qos=qos(latched=True))
        take(reader, 1, f"no {name} before the first touch")
        return reader


def take(reader, count, what="messages are missing"):
    """The next messages, as many as given."""
    taken = []

    def enough():
        taken.extend(sample for sample in reader.take(1000) if sample.sample_info.valid_data)
        return len(taken) >= count

    until(enough, lambda: f"{what}: {count} expected, not {taken}")
    return taken


class Service:
    """A client of one of the node's services."""

    def __init__(self, peer, name, request, response, late=False):
        self.requests = peer.writer(name, request, prefix="rq", suffix="Request")
        self.open = lambda: peer.reader(name, response, prefix="rr", suffix="Reply")
        self.responses = None if late else self.open()

    def ask(self, request):
        self.requests.write(request)

    def ask_before_responses_can_be_heard(self, request):
        """The node hears the request before it knows where responses go, as may happen right after discovery."""
        self.ask(request)
        time.sleep(0.3)
        self.responses = self.open()

    def answer(self):
        [answer] = take(self.responses, 1, "no response")
        return answer

    def call(self, request):
        self.ask(request)
        return self.answer()
